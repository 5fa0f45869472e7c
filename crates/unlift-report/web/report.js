// Assembles the page: reads the figures, makes the controls, draws the charts.
"use strict";

(() => {
  const { STRONGEST, Chain, fieldsOf, element, distinct, single, check, overview, multiples, errors, reliability, chartCount, SceneView, ramp, drawPicture, chosen, wipe, sortable } = window.Unlift;
  const root = document.documentElement;
  const data = JSON.parse(document.getElementById("data").textContent);
  const rows = data.rows.map((row, index) => ({ ...row, index }));
  const fields = fieldsOf(data);
  const redraws = [];
  const at = (id) => document.getElementById(id);

  function curves() {
    const form = at("curve-controls");
    const oracle = rows.filter((row) => data.givens[row.given].group === "oracle");
    const sources = distinct(oracle.map((row) => data.givens[row.given].source));
    const solvers = distinct(oracle.map((row) => row.solver));
    const state = { threshold: data.headline, solver: solvers.length > 1 ? STRONGEST : solvers[0] ?? STRONGEST, source: sources[0] };
    const folded = at("by-scheme");
    const redraw = () => {
      overview(at("chart-overview"), data, state);
      if (folded.open) multiples(at("chart-multiples"), data, state);
    };
    folded.addEventListener("toggle", redraw);
    const options = (values, label) => values.map((value) => ({ value, label: label(value) }));
    single(form, state, "threshold", "Recovered within", data.thresholds.map((t, value) => ({ value, label: t.label })), redraw);
    if (solvers.length > 1) {
      const all = [{ value: STRONGEST, label: "the strongest" }, ...options(solvers, (solver) => data.solvers[solver])];
      single(form, state, "solver", "Solver", all, redraw);
    }
    single(form, state, "source", "Neighbors", options(sources, (source) => data.givens.find((given) => given.source === source).name), redraw);
    redraw();
    redraws.push(redraw);
  }

  /** Runs `work` when a folded part is first opened, because charts in it have no size before. */
  function once(folded, work) {
    folded.addEventListener("toggle", work, { once: true });
  }

  /** Makes a chart over all schemes; it draws the rows of the chosen neighborhoods and solver. */
  function chart(form, node, items, draw, first = data.first_given) {
    const redraw = (chosen) => draw(node, data, chosen.items);
    const chain = new Chain(form, [fields.given, fields.solver], { given: first }, redraw);
    chain.of(items);
    redraws.push(() => redraw(chain));
  }

  function scene() {
    const form = at("scene-controls");
    let view;
    try {
      view = new SceneView(at("canvas"), data);
    } catch (error) {
      at("scene-status").replaceChildren(element("li", {}, "This browser has no WebGL, so the 3D view is empty; all figures are in the tables."));
      root.dataset.scene = "no-webgl";
      return;
    }
    const items = data.scene.views.map((one) => ({ ...rows[one.row], ...one, solverName: data.solvers[rows[one.row].solver] }));
    const wide = at("stage").clientWidth >= 620;
    const state = { show: wide ? "all" : "recovered", cameras: false };
    const redraw = ({ items: [item] }) => {
      const kinds = state.show === "all" ? ["original", "released", "recovered"] : [state.show];
      const shown = { ...item, label: `${item.label}, solver ${item.solverName}` };
      const panes = view.show({ kinds, scheme: data.schemes[item.scheme].name, view: shown, cameras: state.cameras });
      const box = at("panes");
      const across = wide || panes.length === 1;
      box.style[across ? "gridTemplateColumns" : "gridTemplateRows"] = `repeat(${panes.length}, 1fr)`;
      box.style[across ? "gridTemplateRows" : "gridTemplateColumns"] = "1fr";
      box.replaceChildren(...panes.map(({ kind, name, said }) => {
        const pane = element("div", {}, element("span", {}, name));
        // An empty pane shows why it is empty, so that it does not look harmless.
        if (kind === "recovered" && !item.drawn) pane.append(element("strong", {}, said));
        return pane;
      }));
      at("scene-status").replaceChildren(...panes.map(({ name, said }) => element("li", {}, element("b", {}, name), `: ${said}`)));
      root.dataset.scenePoints = item.drawn;
      root.dataset.sceneRow = item.row;
    };
    const again = () => redraw(chain);
    const shows = [["all", "side by side"], ["original", "original"], ["released", "released"], ["recovered", "recovered"]];
    single(form, state, "show", "Show", shows.map(([value, label]) => ({ value, label })), again);
    const chain = new Chain(form, [fields.scheme, fields.given, fields.solver], { given: data.first_given }, redraw);
    if (data.scene.n_cameras) form.append(check("cameras (green)", false, (on) => { state.cameras = on; again(); }));
    ramp(at("ramp"), data.scene, data.unit);
    chain.of(items);
    root.dataset.scene = "drawn";
  }

  function pictures() {
    const form = at("picture-controls");
    const state = { picture: 0 };
    const picture = () => data.pictures[state.picture];
    const options = data.pictures.map(({ name, note }, value) => ({ value, label: note ? `${name} (${note})` : name }));
    single(form, state, "picture", "Image", options, () => chain.of(picture().views));
    const byText = (key, name, label) => ({ key, name, option: (value, views) => ({ label: label(value, views) }) });
    const chain = new Chain(form, [
      byText("scheme", "Scheme", String),
      byText("given", "Neighbors", (_, [view]) => view.label),
      byText("solver", "Solver", String),
    ], { given: data.first_picture }, ({ items: [view] }) => view && drawPicture(data, picture(), view));
    chain.of(picture().views);
    let width = window.innerWidth;
    window.addEventListener("resize", () => {
      if (window.innerWidth === width) return;
      width = window.innerWidth;
      chain.changed(chain);
    });
  }

  const judged = rows.filter((row) => row.reliability.length || row.unknown);
  // The chart starts with neighborhoods that have a curve, because an empty chart looks like a good result.
  const told = judged.filter((row) => row.reliability.length);
  const firstTold = (told.find((row) => row.given === data.first_given) ?? told[0])?.given ?? data.first_given;
  const sheets = [...document.querySelectorAll(".sheet")];
  const parts = [
    [at("curve-controls"), curves],
    [rows.length, () => chart(at("error-controls"), at("chart-errors"), rows, errors)],
    [at("certainty"), () => once(at("certainty"), () => chart(at("reliability-controls"), at("chart-reliability"), judged, reliability, firstTold))],
    [data.scene, scene],
    [data.pictures.length, pictures],
    [sheets.length, () => chosen(sheets)],
    ...sheets.map((sheet) => [true, () => wipe(sheet)]),
    ...[...document.querySelectorAll("table")].map((table) => [true, () => sortable(table)]),
  ];
  root.dataset.script = "1";
  for (const [wanted, part] of parts) {
    // If one part fails, the others are still drawn.
    try { if (wanted) part(); } catch (error) { console.error(error); }
  }
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraws.forEach((redraw) => redraw()));
  root.dataset.charts = chartCount();
  root.dataset.tables = document.querySelectorAll("table").length;
  root.dataset.ready = "1";
})();
