// Curves: recovered share over inlier ratio, and share over error. Drawn by ECharts as SVG.
"use strict";
window.Unlift = window.Unlift || {};

(() => {
  const { echarts } = window.UnliftVendor;
  const MARKS = ["circle", "rect", "triangle", "diamond", "emptyCircle", "emptyRect", "emptyTriangle", "emptyDiamond"];
  const SOLVER_MARKS = ["circle", "emptyRect", "emptyTriangle", "emptyDiamond", "emptyCircle"];
  const drawn = new Map();

  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const color = (slot) => css(`--s${slot}`);

  /** An element with text and children; text never passes through innerHTML. */
  function element(tag, attributes = {}, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    node.append(...children);
    return node;
  }

  /** A length of the document's unit, as the tables say it. */
  function length(value, unit) {
    const short = (x) => String(Number(x.toPrecision(2)));
    if (unit !== "m") return `${short(value)} ${unit}`;
    if (value >= 1) return `${short(value)} m`;
    return value >= 0.01 ? `${short(value * 100)} cm` : `${short(value * 1000)} mm`;
  }

  /** Creates or updates the chart in `node` and keeps it at the node's size. */
  function draw(node, option) {
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
      axisLabel: { color: css("--soft"), fontSize: 11 },
      axisLine: { lineStyle: { color: css("--line") } },
      axisTick: { show: false },
      splitLine: { lineStyle: { color: css("--line"), width: 1 } },
      nameLocation: "middle",
      ...extra,
    };
  }

  const percentAxis = (extra) =>
    axis({ type: "value", min: 0, max: 100, interval: 25, axisLabel: { formatter: "{value} %", color: css("--soft"), fontSize: 11 }, ...extra });

  /** The box beside the pointer: one line per curve, largest first. */
  function tooltip(head) {
    return {
      trigger: "axis",
      confine: true,
      backgroundColor: css("--card"),
      borderColor: css("--line"),
      textStyle: { color: css("--ink"), fontSize: 12 },
      formatter: (items) => {
        const box = element("div", {}, element("strong", {}, head(items[0].value[0])));
        for (const item of [...items].sort((a, b) => b.value[1] - a.value[1])) {
          const dot = element("span", { style: `display:inline-block;width:.7em;height:.7em;border-radius:50%;margin-right:.5em;background:${item.color}` });
          box.append(element("div", {}, dot, `${item.seriesName}: ${item.value[1].toFixed(1)} %`));
        }
        return box;
      },
    };
  }

  const baseOption = (grid) => ({
    animation: false,
    aria: { enabled: false },
    textStyle: { fontFamily: getComputedStyle(document.body).fontFamily },
    grid: { left: 46, right: 18, top: 14, bottom: 44, ...grid },
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

  /** Rows of one scheme and solver as points (ratio in percent, percent), rising. */
  function curve(data, scheme, solver, column, threshold) {
    return data.rows
      .filter((row) => row.scheme === scheme && row.solver === solver && row[column][threshold] !== null)
      .map((row) => [row.ratio * 100, row[column][threshold]])
      .sort((a, b) => a[0] - b[0]);
  }

  const ratioAxis = () =>
    percentAxis({ name: "neighbors that are right", nameGap: 28, interval: 20, splitLine: { show: false } });

  const SVG = "http://www.w3.org/2000/svg";

  /** A legend entry: a sample of the line with its mark, and its name. */
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
    const dashes = { solid: "none", dashed: "6 4", dotted: "2 3" }[dash];
    part("line", { x1: 0, x2: 30, y1: 6, y2: 6, stroke, "stroke-width": 2, "stroke-dasharray": dashes });
    const shape = (mark || "none").replace("empty", "").toLowerCase();
    const fill = (mark || "").startsWith("empty") ? css("--paper") : stroke;
    const points = { rect: "11,2 19,2 19,10 11,10", triangle: "15,1 20,10 10,10", diamond: "15,0 20,6 15,12 10,6" }[shape];
    if (points) part("polygon", { points, fill, stroke, "stroke-width": 1.5 });
    if (shape === "circle") part("circle", { cx: 15, cy: 6, r: 4, fill, stroke, "stroke-width": 1.5 });
    return element("span", {}, svg, name);
  }

  function legend(id, entries) {
    document.getElementById(id)?.replaceChildren(...entries.map((entry) => legendEntry(...entry)));
  }

  const schemeEntries = (data) => data.schemes.map((s) => [s.name, color(s.slot), "solid", MARKS[s.slot]]);

  /** All schemes at one threshold and solver, with the blind attacker of each. */
  function overview(node, data, { threshold, solver }) {
    const series = [];
    for (const scheme of data.schemes) {
      const blind = curve(data, scheme.name, solver, "blind", threshold);
      series.push(line(scheme.name, curve(data, scheme.name, solver, "recovered", threshold), scheme.slot));
      series.push(line(`${scheme.name}, blind`, blind, scheme.slot, { dash: "dotted", width: 1.4, opacity: 0.8, mark: "none" }));
    }
    draw(node, {
      ...baseOption(),
      tooltip: tooltip((x) => `${+x.toFixed(1)} % of neighbors right, within ${data.thresholds[threshold].label}`),
      xAxis: ratioAxis(),
      yAxis: percentAxis({}),
      series: series.filter((one) => one.data.length),
    });
    legend("overview-legend", [...schemeEntries(data), ["blind", css("--soft"), "dotted", "none"]]);
  }

  /** One small chart per scheme: every threshold and solver, the paper's curves, the blind line. */
  function multiples(node, data, { dataset, threshold: chosen }) {
    // More than two thresholds would be a thicket: then the chosen one alone.
    const few = data.thresholds.length <= 2;
    const first = few ? 0 : chosen;
    data.schemes.forEach((scheme, index) => {
      let figure = node.children[index];
      if (!figure) {
        const caption = element("figcaption", {}, `${scheme.name} `, element("span", {}, scheme.title));
        const label = `${scheme.title}: percent recovered over the share of right neighbors`;
        figure = element("figure", {}, caption, element("div", { class: "chart", role: "img", "aria-label": label }));
        node.append(figure);
      }
      const series = [];
      data.thresholds.forEach((threshold, t) => {
        if (!few && t !== chosen) return;
        const opacity = t === first ? 1 : 0.55;
        data.solvers.forEach((solver, s) => {
          const style = { opacity, width: s === 0 ? 2.2 : 1.4, size: 6, mark: SOLVER_MARKS[s] };
          const name = data.solvers.length > 1 ? `${threshold.label}, ${solver}` : threshold.label;
          series.push(line(name, curve(data, scheme.name, solver, "recovered", t), scheme.slot, style));
        });
        for (const paper of data.published) {
          if (paper.dataset !== dataset || paper.scheme !== scheme.name || paper.threshold !== t) continue;
          const points = paper.points.map(([ratio, percent]) => [ratio * 100, percent]).sort((a, b) => a[0] - b[0]);
          series.push(line(`${threshold.label}, paper`, points, scheme.slot, { dash: "dashed", width: 1.5, opacity, mark: "none" }));
        }
        const blind = curve(data, scheme.name, data.solvers[0], "blind", t);
        series.push(line(`${threshold.label}, blind`, blind, scheme.slot, { dash: "dotted", width: 1.5, opacity, mark: "none" }));
      });
      draw(figure.querySelector(".chart"), {
        ...baseOption({ right: 10, top: 10 }),
        tooltip: tooltip((x) => `${+x.toFixed(1)} % of neighbors right`),
        xAxis: ratioAxis(),
        yAxis: percentAxis({}),
        series: series.filter((one) => one.data.length),
      });
    });
    const ink = css("--ink");
    const shown = data.thresholds.filter((_, t) => few || t === chosen);
    const entries = shown.map((t, i) => [
      `within ${t.label}`, i === 0 ? ink : css("--soft"), "solid", "circle"]);
    data.solvers.slice(1).forEach((solver, s) => entries.push([solver, ink, "solid", SOLVER_MARKS[s + 1]]));
    if (data.published.length) entries.push([`the paper's, on ${dataset}`, ink, "dashed", "none"]);
    entries.push(["blind", ink, "dotted", "none"]);
    legend("multiples-legend", entries);
  }

  /** Percent of the points over error, one curve per scheme, thresholds as upright lines. */
  // A source that is no oracle has one row, at the ratio that was measured.
  const rowOf = (data, scheme, { ratio, solver }) =>
    data.rows.find((r) => r.scheme === scheme.name && r.solver === solver && (r.ratio === ratio || !r.oracle));

  function errors(node, data, { ratio, solver }) {
    const smallest = Math.min(...data.rows.flatMap((row) => row.errors.map(([e]) => e)).filter((e) => e > 0));
    const series = [];
    for (const scheme of data.schemes) {
      const row = rowOf(data, scheme, { ratio, solver });
      const points = (row?.errors ?? []).map(([e, percent]) => [Math.max(e, smallest), percent]);
      series.push(line(scheme.name, points, scheme.slot, { mark: points.length > 20 ? "none" : MARKS[scheme.slot] }));
    }
    for (const { label, value } of data.thresholds) {
      if (!(value > 0)) continue;
      const upright = line(label, [[value, 100], [value, 0]], 4, { dash: "dotted", width: 1, mark: "none" });
      series.push({ ...upright, silent: true, endLabel: { show: true, formatter: label, color: css("--soft"), fontSize: 11, offset: [-4, -9] } });
    }
    draw(node, {
      ...baseOption({ right: 26, top: 22 }),
      tooltip: { ...tooltip(() => ""), trigger: "item", formatter: (item) =>
        element("span", {}, `${item.seriesName}: ${item.value[1].toFixed(1)} % within ${length(item.value[0], data.unit)}`) },
      xAxis: axis({ type: "log", name: "error", nameGap: 28, min: smallest > 0 && isFinite(smallest) ? 10 ** Math.floor(Math.log10(smallest)) : undefined,
        axisLabel: { formatter: (v) => length(v, data.unit), color: css("--soft"), fontSize: 11, hideOverlap: true } }),
      yAxis: percentAxis({}),
      series: series.filter((one) => one.data.length),
    });
    legend("errors-legend", schemeEntries(data));
  }

  /** What came true over what the attacker said, one curve per scheme; the diagonal is a perfect judge. */
  function reliability(node, data, { ratio, solver }) {
    const series = [];
    for (const scheme of data.schemes) {
      const row = rowOf(data, scheme, { ratio, solver });
      series.push(line(scheme.name, row?.reliability ?? [], scheme.slot));
    }
    const diagonal = line("perfect", [[0, 0], [100, 100]], 4, { dash: "dotted", width: 1, mark: "none" });
    draw(node, {
      ...baseOption({ right: 26, top: 22 }),
      tooltip: { ...tooltip(() => ""), trigger: "item", formatter: (item) =>
        element("span", {}, `${item.seriesName}: ${item.value[1].toFixed(1)} % right where ${item.value[0].toFixed(1)} % was said`) },
      xAxis: axis({ type: "value", min: 0, max: 100, name: "said, %", nameGap: 28 }),
      yAxis: percentAxis({}),
      series: [...series.filter((one) => one.data.length), { ...diagonal, silent: true }],
    });
    legend("reliability-legend", schemeEntries(data));
  }

  Object.assign(window.Unlift, { element, length, css, color, overview, multiples, errors, reliability, chartCount: () => drawn.size });
})();
