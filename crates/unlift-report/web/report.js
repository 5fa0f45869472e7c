// Puts the page together: reads the figures, makes the controls, draws what they ask for.
"use strict";

(() => {
  const { element, overview, multiples, errors, reliability, chartCount, SceneView, ramp, drawPicture } = window.Unlift;
  const root = document.documentElement;
  const data = JSON.parse(document.getElementById("data").textContent);
  const percent = (ratio) => `${+(ratio * 100).toPrecision(2)} %`;
  const distinct = (items) => [...new Set(items)];
  // Of the oracle, where there is one: other sources have one ratio each, the measured one.
  const ratiosOf = (rows) => {
    const asked = rows.filter((row) => row.oracle);
    return distinct((asked.length ? asked : rows).map((row) => row.ratio)).sort((a, b) => b - a);
  };
  const nearestHalf = (ratios) => ratios.reduce((a, b) => (Math.abs(b - 0.5) < Math.abs(a - 0.5) ? b : a), ratios[0]);

  /** A row of buttons of which one is chosen; not drawn when there is nothing to choose. */
  function choice(form, state, key, name, options, changed) {
    if (options.length < 2) return;
    const box = element("div", { class: "choices" });
    for (const [value, label] of options) {
      const input = element("input", { type: "radio", name: `${form.id}-${key}` });
      input.checked = state[key] === value;
      input.addEventListener("change", () => { state[key] = value; changed(); });
      box.append(element("label", {}, input, element("span", {}, label)));
    }
    form.append(element("fieldset", {}, element("legend", {}, name), box));
  }

  /** A drop-down list, for choices that are too many for buttons. */
  function list(form, state, key, name, options, changed) {
    if (options.length < 2) return;
    const select = element("select", {});
    options.forEach(([value, label], index) => {
      select.append(element("option", { value: index }, label));
      if (state[key] === value) select.selectedIndex = index;
    });
    select.addEventListener("change", () => { state[key] = options[select.selectedIndex][0]; changed(); });
    form.append(element("label", {}, element("span", { class: "name" }, name), select));
  }

  function check(form, state, key, name, changed) {
    const input = element("input", { type: "checkbox" });
    input.checked = state[key];
    input.addEventListener("change", () => { state[key] = input.checked; changed(); });
    form.append(element("label", { class: "check" }, input, name));
  }

  const solverOptions = data.solvers.map((solver) => [solver, solver]);
  const redraws = [];

  function curves() {
    const form = document.getElementById("curve-controls");
    const datasets = distinct(data.published.map((curve) => curve.dataset));
    const state = { threshold: data.headline, solver: data.solvers[0], dataset: datasets[0] };
    const redraw = () => {
      overview(document.getElementById("chart-overview"), data, state);
      multiples(document.getElementById("chart-multiples"), data, state);
    };
    choice(form, state, "threshold", "Recovered within", data.thresholds.map((t, i) => [i, t.label]), redraw);
    choice(form, state, "solver", "Solver", solverOptions, redraw);
    list(form, state, "dataset", "The paper's curves, on", datasets.map((d) => [d, d]), redraw);
    redraw();
    redraws.push(redraw);
  }

  function distribution() {
    const form = document.getElementById("error-controls");
    const ratios = ratiosOf(data.rows);
    const state = { ratio: nearestHalf(ratios), solver: data.solvers[0] };
    const redraw = () => errors(document.getElementById("chart-errors"), data, state);
    const options = ratios.map((ratio) => [ratio, percent(ratio)]);
    (ratios.length > 8 ? list : choice)(form, state, "ratio", "Neighbors right", options, redraw);
    choice(form, state, "solver", "Solver", solverOptions, redraw);
    redraw();
    redraws.push(redraw);
  }

  function judged() {
    const rows = data.rows.filter((row) => row.reliability.length);
    const form = document.getElementById("reliability-controls");
    if (!form || !rows.length) return;
    const ratios = ratiosOf(rows);
    const solvers = distinct(rows.map((row) => row.solver));
    const state = { ratio: nearestHalf(ratios), solver: solvers[0] };
    const redraw = () => reliability(document.getElementById("chart-reliability"), data, state);
    const options = ratios.map((ratio) => [ratio, percent(ratio)]);
    (ratios.length > 8 ? list : choice)(form, state, "ratio", "Neighbors right", options, redraw);
    choice(form, state, "solver", "Solver", solvers.map((solver) => [solver, solver]), redraw);
    redraw();
    redraws.push(redraw);
  }

  function scene() {
    const status = document.getElementById("scene-status");
    const form = document.getElementById("scene-controls");
    let view;
    try {
      view = new SceneView(document.getElementById("canvas"), data);
    } catch (error) {
      status.textContent = "This browser offers no WebGL, so the 3D view stays empty; all figures stand in the tables.";
      root.dataset.scene = "no-webgl";
      return;
    }
    const views = data.scene.views;
    const schemes = distinct(views.map((v) => v.scheme));
    const ratios = distinct(views.map((v) => v.inlier_ratio)).sort((a, b) => b - a);
    const wide = document.getElementById("stage").clientWidth >= 620;
    const state = {
      scheme: schemes[0],
      ratio: ratios.length ? nearestHalf(ratios) : null,
      solver: views[0]?.solver,
      show: wide ? "all" : "recovered",
      cameras: false,
    };
    const names = { original: "original", obfuscated: "released", recovered: "recovered" };
    const redraw = () => {
      const panes = view.show(state);
      const box = document.getElementById("panes");
      const across = wide || panes.length === 1;
      box.style[across ? "gridTemplateColumns" : "gridTemplateRows"] = `repeat(${panes.length}, 1fr)`;
      box.style[across ? "gridTemplateRows" : "gridTemplateColumns"] = "1fr";
      box.replaceChildren(...panes.map(({ kind }) => element("span", {}, kind === "original" ? names[kind] : `${names[kind]}, ${state.scheme}`)));
      const parts = panes.map(({ kind, layer }) => {
        if (!layer) return `${names[kind]}: nothing to draw for this choice`;
        const lost = layer.lost ? `, ${layer.lost} lost` : "";
        const outside = layer.outside > 0 && kind !== "obfuscated" ? `, ${layer.outside} outside the box` : "";
        return `${names[kind]}: ${layer.drawn} drawn${lost}${outside}`;
      });
      status.textContent = parts.join(" · ");
      const shown = panes.find(({ kind }) => kind === "recovered")?.layer ?? panes[0].layer;
      root.dataset.scenePoints = shown ? shown.drawn : 0;
    };
    const shows = [["all", "side by side"], ["original", "original"], ["obfuscated", "released"], ["recovered", "recovered"]];
    choice(form, state, "show", "Show", shows, redraw);
    const schemeOptions = schemes.map((s) => [s, s]);
    (schemes.length > 8 ? list : choice)(form, state, "scheme", "Scheme", schemeOptions, redraw);
    const ratioOptions = ratios.map((r) => [r, percent(r)]);
    (ratios.length > 8 ? list : choice)(form, state, "ratio", "Neighbors right", ratioOptions, redraw);
    choice(form, state, "solver", "Solver", distinct(views.map((v) => v.solver)).map((s) => [s, s]), redraw);
    if (data.scene.n_cameras) check(form, state, "cameras", "cameras (green)", redraw);
    ramp(document.getElementById("ramp"), data.scene, data.unit);
    redraw();
    root.dataset.scene = "drawn";
  }

  function pictures() {
    const form = document.getElementById("picture-controls");
    const views = data.pictures.flatMap((picture) => picture.views);
    const schemes = distinct(views.map((view) => view.scheme));
    const state = { picture: 0, scheme: schemes[0], given: null };
    // What an attacker's own lists are worth differs from image to image, and so does their name.
    const given = () => distinct(data.pictures[state.picture].views.map((view) => view.given));
    const usual = (names) => names.find((name) => name === "50 %") ?? names[0];
    let at = given().indexOf(usual(given()));
    const redraw = () => {
      at = Math.max(0, given().indexOf(state.given));
      drawPicture(data, state);
    };
    const controls = () => {
      form.replaceChildren();
      state.given = given()[at];
      const names = data.pictures.map((picture, i) => [i, picture.note ? `${picture.name} (${picture.note})` : picture.name]);
      list(form, state, "picture", "Image", names, () => { controls(); redraw(); });
      choice(form, state, "scheme", "Scheme", schemes.map((scheme) => [scheme, scheme]), redraw);
      const options = given().map((name) => [name, name]);
      (options.length > 8 ? list : choice)(form, state, "given", "Neighbors right", options, redraw);
    };
    controls();
    redraw();
    let width = window.innerWidth;
    window.addEventListener("resize", () => {
      if (window.innerWidth === width) return;
      width = window.innerWidth;
      drawPicture(data, state);
    });
  }

  root.dataset.script = "1";
  if (data.rows.length) {
    curves();
    distribution();
    judged();
  }
  if (data.scene) scene();
  if (data.pictures.length) pictures();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraws.forEach((redraw) => redraw()));
  root.dataset.charts = chartCount();
  root.dataset.tables = document.querySelectorAll("table").length;
  root.dataset.ready = "1";
})();
