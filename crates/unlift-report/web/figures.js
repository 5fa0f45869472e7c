// The charts: recovered share over right neighbors, share over error, correct share over estimated probability.
"use strict";

(() => {
  const { MARKS, element, distinct, length, css, color, draw, axis, percentAxis, below, tooltip, itemTooltip, baseOption, line, mark, legend } = window.Unlift;
  const SOLVER_MARKS = ["circle", "emptyRect", "emptyTriangle", "emptyDiamond", "emptyCircle"];
  const SOURCE_MARKS = ["diamond", "triangle", "rect", "circle"];
  /** The choice of the strongest solver of every cell. */
  const STRONGEST = -1;
  const DASH_DOT = [7, 3, 2, 3];

  const groupOf = (data, row) => data.givens[row.given].group;
  const sourceOf = (data, row) => data.givens[row.given].source;
  const isPicked = (row, solver, t) => solver === STRONGEST ? row.strongest[t] : row.solver === solver;

  /** Returns the sources of single marks: their ratio is measured, so they have no curve. */
  const ownSources = (data) =>
    distinct(data.rows.filter((row) => groupOf(data, row) !== "oracle").map((row) => sourceOf(data, row)));

  const nameOf = (data, source) => data.givens.find((given) => given.source === source).name;
  const sourceMark = (own, source) => SOURCE_MARKS[own.indexOf(source) % SOURCE_MARKS.length];
  const place = (row, t) => [row.ratio * 100, row.recovered[t]];
  const rising = (points) => points.sort((a, b) => a[0] - b[0]);
  const across = (value) => (value === null ? [] : [[0, value], [100, value]]);

  /** Returns a scheme's rows of the oracle and of the attacker's own sources. */
  function rowsOf(data, s, { threshold: t, solver, source }) {
    const all = data.rows.map((row, index) => ({ row, index }));
    const picked = all.filter(({ row }) => row.scheme === s && row.recovered[t] !== null && isPicked(row, solver, t));
    return {
      oracle: picked.filter(({ row }) => groupOf(data, row) === "oracle" && sourceOf(data, row) === source),
      own: picked.filter(({ row }) => groupOf(data, row) !== "oracle"),
    };
  }

  const ratioAxis = () =>
    percentAxis({ ...below("right neighbors in the lists", "{value} %"), interval: 20, splitLine: { show: false } });

  const schemeEntries = (schemes) => schemes.map((s) => [s.name, color(s.slot), "solid", MARKS[s.slot]]);
  const sourceEntries = (data) =>
    ownSources(data).map((source, i) => [nameOf(data, source), css("--ink"), "none", SOURCE_MARKS[i % SOURCE_MARKS.length]]);

  /** Draws all schemes at one threshold and solver, each with its larger baseline. */
  function overview(node, data, state) {
    const t = state.threshold;
    const own = ownSources(data);
    const [series, shown] = [[], []];
    data.schemes.forEach((scheme, s) => {
      const rows = rowsOf(data, s, state);
      shown.push(...[...rows.oracle, ...rows.own].map(({ index }) => index));
      series.push(line(scheme.name, rising(rows.oracle.map(({ row }) => place(row, t))), scheme.slot));
      for (const { row } of rows.own) {
        series.push(mark(`${scheme.name}, ${row.label}`, place(row, t), scheme.slot, sourceMark(own, sourceOf(data, row))));
      }
      const floor = { dash: "dotted", width: 1.4, opacity: 0.8, mark: "none" };
      series.push(line(`${scheme.name}, without lists of neighbors`, across(scheme.floor[t]), scheme.slot, floor));
    });
    draw(node, {
      ...baseOption(),
      tooltip: tooltip((x) => `${+x.toFixed(1)} % right neighbors, within ${data.thresholds[t].label}`),
      xAxis: ratioAxis(),
      yAxis: percentAxis({}),
      series: series.filter((one) => one.data.length),
    }, shown);
    legend("overview-legend", [...schemeEntries(data.schemes), ...sourceEntries(data), ["without lists of neighbors", css("--soft"), "dotted", "none"]]);
  }

  /** Draws one chart per scheme: all solvers, the attacker's own sources, both baselines. */
  function multiples(node, data, { threshold: t, source }) {
    const own = ownSources(data);
    const solvers = distinct(data.rows.filter((row) => groupOf(data, row) === "oracle").map((row) => row.solver));
    const thin = { width: 1.5, mark: "none" };
    data.schemes.forEach((scheme, s) => {
      let figure = node.children[s];
      if (!figure) {
        const caption = element("figcaption", {}, `${scheme.name} `, element("span", {}, scheme.title));
        const label = `${scheme.title}: percent recovered over the share of right neighbors`;
        figure = element("figure", {}, caption, element("div", { class: "chart", role: "img", "aria-label": label }));
        node.append(figure);
      }
      const [series, shown] = [[], []];
      solvers.forEach((solver, at) => {
        const rows = rowsOf(data, s, { threshold: t, solver, source }).oracle;
        shown.push(...rows.map(({ index }) => index));
        const style = { width: at === 0 ? 2.2 : 1.4, size: 6, mark: SOLVER_MARKS[at % SOLVER_MARKS.length] };
        series.push(line(`solver ${data.solvers[solver]}`, rising(rows.map(({ row }) => place(row, t))), scheme.slot, style));
      });
      for (const { row, index } of rowsOf(data, s, { threshold: t, solver: STRONGEST, source }).own) {
        const name = `${row.label}, solver ${data.solvers[row.solver]}`;
        shown.push(index);
        series.push(mark(name, place(row, t), scheme.slot, sourceMark(own, sourceOf(data, row)), 11));
      }
      series.push(line("blind guess", across(scheme.blind[t]), scheme.slot, { ...thin, dash: "dotted" }));
      series.push(line(scheme.alone_by, across(scheme.alone[t]), scheme.slot, { ...thin, dash: DASH_DOT }));
      draw(figure.querySelector(".chart"), {
        ...baseOption({ right: 12, top: 10 }),
        tooltip: tooltip((x) => `${+x.toFixed(1)} % right neighbors`),
        xAxis: ratioAxis(),
        yAxis: percentAxis({}),
        series: series.filter((one) => one.data.length),
      }, shown);
    });
    const ink = css("--ink");
    const entries = solvers.map((solver, at) => [`solver ${data.solvers[solver]}`, ink, "solid", SOLVER_MARKS[at % SOLVER_MARKS.length]]);
    entries.push(...sourceEntries(data));
    entries.push(["blind guess", ink, "dotted", "none"]);
    if (data.schemes.some((scheme) => scheme.alone[t] !== null)) entries.push(["records alone", ink, "dashdot", "none"]);
    legend("multiples-legend", entries);
  }

  /** Writes what a chart over all schemes shows, and which schemes are missing. */
  function say(id, data, rows, more = []) {
    const there = distinct(rows.map((row) => row.scheme));
    const missing = data.schemes.filter((_, s) => !there.includes(s)).map((scheme) => scheme.name);
    const [row] = rows;
    const words = row ? [`Shown: ${data.givens[row.given].label}, solver ${data.solvers[row.solver]}.`] : ["Nothing to show."];
    if (row && missing.length) words.push(`Not tried with these: ${missing.join(", ")}.`);
    document.getElementById(id).textContent = [...words, ...more].join(" ");
  }

  const shownSchemes = (data, rows) => data.schemes.filter((_, s) => rows.some((row) => row.scheme === s));

  /** Draws the percentage of the points over the error, one curve per scheme; thresholds are vertical lines. */
  function errors(node, data, rows) {
    const smallest = Math.min(...data.rows.flatMap((row) => row.errors.map(([e]) => e)).filter((e) => e > 0));
    const series = rows.map((row) => {
      const scheme = data.schemes[row.scheme];
      const points = row.errors.map(([e, percent]) => [Math.max(e, smallest), percent]);
      return line(scheme.name, points, scheme.slot, { mark: points.length > 20 ? "none" : MARKS[scheme.slot] });
    });
    // Labels of thresholds alternate between two lines above the plot, so that near ones do not overlap.
    data.thresholds.filter(({ value }) => value > 0).forEach(({ label, value }, at) => {
      const upright = line(label, [[value, 0], [value, 100]], 4, { dash: "dotted", width: 1, mark: "none" });
      series.push({ ...upright, silent: true, endLabel: { show: true, formatter: label, color: css("--soft"), fontSize: 11, align: "center", verticalAlign: "bottom", offset: [-5, at % 2 ? -4 : -20] } });
    });
    draw(node, {
      ...baseOption({ right: 26, top: 44 }),
      tooltip: itemTooltip((item) => `${item.seriesName}: ${item.value[1].toFixed(1)} % within ${length(item.value[0], data.unit)}`),
      xAxis: axis({ type: "log", ...below("error", (v) => length(v, data.unit)), min: smallest > 0 && isFinite(smallest) ? 10 ** Math.floor(Math.log10(smallest)) : undefined }),
      yAxis: percentAxis({}),
      series: series.filter((one) => one.data.length),
    }, rows.map((row) => row.index));
    legend("errors-legend", schemeEntries(shownSchemes(data, rows)));
    say("errors-shown", data, rows);
  }

  /** Draws the correct share over the estimated probability, one curve per scheme; the diagonal is a perfect estimate. */
  function reliability(node, data, rows) {
    const known = rows.filter((row) => row.reliability.length);
    const series = known.map((row) => line(data.schemes[row.scheme].name, row.reliability, data.schemes[row.scheme].slot));
    const diagonal = line("perfect", [[0, 0], [100, 100]], 4, { dash: "dotted", width: 1, mark: "none" });
    draw(node, {
      ...baseOption({ right: 26, top: 22 }),
      tooltip: itemTooltip((item) => `${item.seriesName}: ${item.value[1].toFixed(1)} % were right where ${item.value[0].toFixed(1)} % was estimated`),
      xAxis: axis({ type: "value", min: 0, max: 100, ...below("estimated probability, %", "{value}") }),
      yAxis: percentAxis({}),
      series: [...series, { ...diagonal, silent: true }],
    }, known.map((row) => row.index));
    legend("reliability-legend", schemeEntries(shownSchemes(data, known)));
    const reasons = distinct(rows.map((row) => row.unknown).filter(Boolean));
    say("reliability-shown", data, rows, reasons.map((reason) => {
      const names = rows.filter((row) => row.unknown === reason).map((row) => data.schemes[row.scheme].name);
      return `Not known here for ${names.join(", ")}: ${reason}.`;
    }));
  }

  Object.assign(window.Unlift, { STRONGEST, overview, multiples, errors, reliability });
})();
