// Shared parts of all charts: drawing (by ECharts, as SVG), axes, lines, marks, legends.
"use strict";

(() => {
  const { echarts } = window.UnliftVendor;
  const { element } = window.Unlift;
  const MARKS = ["circle", "rect", "triangle", "diamond", "emptyCircle", "emptyRect", "emptyTriangle", "emptyDiamond"];
  const drawn = new Map();

  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const color = (slot) => css(`--s${slot}`);

  /** Formats a length of the document's unit as in the tables. */
  function length(value, unit) {
    const short = (x) => x.toLocaleString("en-US", { maximumSignificantDigits: 2 });
    if (unit === "×") return `${short(value)}×`;
    if (unit !== "m") return `${short(value)} ${unit}`;
    if (value >= 1) return `${short(value)} m`;
    return value >= 0.01 ? `${short(value * 100)} cm` : `${short(value * 1000)} mm`;
  }

  /** Creates or updates the chart in `node` and keeps it at the node's size; `rows` are the rows that it shows. */
  function draw(node, option, rows = []) {
    node.dataset.rows = rows.join(" ");
    let chart = drawn.get(node);
    if (!chart) {
      chart = echarts.init(node, null, { renderer: "svg" });
      drawn.set(node, chart);
      new ResizeObserver(() => chart.resize()).observe(node);
    }
    chart.setOption(option, { notMerge: true });
  }

  function axis(extra) {
    return {
      nameTextStyle: { color: css("--soft"), fontSize: 12 },
      axisLabel: { color: css("--soft"), fontSize: 11, hideOverlap: true },
      axisLine: { lineStyle: { color: css("--line") } },
      axisTick: { show: false },
      splitLine: { lineStyle: { color: css("--line"), width: 1 } },
      nameLocation: "middle",
      ...extra,
    };
  }

  const labels = (formatter, margin = 8) => ({ formatter, margin, color: css("--soft"), fontSize: 11, hideOverlap: true });

  const percentAxis = (extra) => axis({ type: "value", min: 0, max: 100, interval: 25, axisLabel: labels("{value} %"), ...extra });

  /** Returns options of the horizontal axis, low enough that its first label clears the vertical axis. */
  const below = (name, formatter) => ({ name, nameGap: 34, axisLabel: labels(formatter, 14) });

  const box = () => ({
    confine: true,
    backgroundColor: css("--card"),
    borderColor: css("--line"),
    textStyle: { color: css("--ink"), fontSize: 12 },
  });

  /** Returns the box beside the pointer: one line per curve, the largest value first. */
  function tooltip(head) {
    return {
      ...box(),
      trigger: "axis",
      formatter: (items) => {
        const node = element("div", {}, element("strong", {}, head(items[0].value[0])));
        for (const item of [...items].sort((a, b) => b.value[1] - a.value[1])) {
          const dot = element("span", { style: `display:inline-block;width:.7em;height:.7em;border-radius:50%;margin-right:.5em;background:${item.color}` });
          node.append(element("div", {}, dot, `${item.seriesName}: ${item.value[1].toFixed(1)} %`));
        }
        return node;
      },
    };
  }

  /** Returns the box beside the point under the pointer. */
  const itemTooltip = (say) => ({ ...box(), trigger: "item", formatter: (item) => element("span", {}, say(item)) });

  const baseOption = (grid) => ({
    animation: false,
    aria: { enabled: false },
    textStyle: { fontFamily: getComputedStyle(document.body).fontFamily },
    grid: { left: 46, right: 18, top: 14, bottom: 52, ...grid },
  });

  function line(name, data, slot, style = {}) {
    const { dash = "solid", width = 2.2, opacity = 1, mark = MARKS[slot], size = 7 } = style;
    const stroke = color(slot);
    return {
      type: "line",
      name,
      data,
      color: stroke,
      symbol: mark,
      symbolSize: size,
      showSymbol: mark !== "none",
      lineStyle: { type: dash, width, opacity, color: stroke },
      itemStyle: { opacity, color: stroke },
      emphasis: { disabled: true },
    };
  }

  /** Returns a hollow mark that lies on no curve, as a line of one point, because the bundle draws only lines. */
  function mark(name, point, slot, symbol, size = 13) {
    const hollow = { color: css("--paper"), borderColor: color(slot), borderWidth: 2.5 };
    return { ...line(name, [point], slot, { mark: symbol, size }), itemStyle: hollow, z: 5 };
  }

  const SVG = "http://www.w3.org/2000/svg";

  /** Makes a legend entry: a sample of the line with its mark, and its name. */
  function legendEntry(name, stroke, dash, mark) {
    const svg = document.createElementNS(SVG, "svg");
    svg.setAttribute("width", "30");
    svg.setAttribute("height", "12");
    svg.setAttribute("aria-hidden", "true");
    const part = (tag, attributes) => {
      const node = document.createElementNS(SVG, tag);
      for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
      svg.append(node);
    };
    const dashes = { solid: "none", dashed: "6 4", dotted: "2 3", dashdot: "7 3 2 3" }[dash];
    if (dashes) part("line", { x1: 0, x2: 30, y1: 6, y2: 6, stroke, "stroke-width": 2, "stroke-dasharray": dashes });
    const shape = (mark || "none").replace("empty", "").toLowerCase();
    const hollow = (mark || "").startsWith("empty") || !dashes;
    const fill = hollow ? css("--paper") : stroke;
    const width = dashes ? 1.5 : 2.2;
    const points = { rect: "11,2 19,2 19,10 11,10", triangle: "15,1 20,10 10,10", diamond: "15,0 20,6 15,12 10,6" }[shape];
    if (points) part("polygon", { points, fill, stroke, "stroke-width": width });
    if (shape === "circle") part("circle", { cx: 15, cy: 6, r: 4, fill, stroke, "stroke-width": width });
    return element("span", {}, svg, name);
  }

  function legend(id, entries) {
    document.getElementById(id)?.replaceChildren(...entries.map((entry) => legendEntry(...entry)));
  }

  Object.assign(window.Unlift, {
    MARKS, length, css, color, draw, axis, percentAxis, below, tooltip, itemTooltip, baseOption, line, mark, legend,
    chartCount: () => drawn.size,
  });
})();
