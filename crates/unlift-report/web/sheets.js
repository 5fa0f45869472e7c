// Painted pictures: one photo at a time, and a picture laid over its photo with a movable edge.
"use strict";

(() => {
  const { element, single } = window.Unlift;

  /** Shows the sheet that a menu chooses. */
  function chosen(sheets) {
    const state = { sheet: 0 };
    const show = () => sheets.forEach((sheet, at) => { sheet.hidden = at !== state.sheet; });
    const options = sheets.map((sheet, value) => ({ value, label: sheet.dataset.name }));
    single(document.getElementById("sheet-controls"), state, "sheet", "Photo", options, show);
    show();
  }

  /** Returns the label of a picture with its scheme. */
  function named(shot) {
    const scheme = shot.closest(".of-scheme")?.querySelector("h3");
    const label = shot.closest("figure").querySelector("strong").textContent;
    return scheme ? `${scheme.textContent}, ${label}` : label;
  }

  /** Adds a slider to a scheme with one picture per number of queries. */
  function steps(row, choose) {
    const shots = [...row.querySelectorAll("button.shot")];
    if (shots.length < 2) return;
    const range = element("input", { type: "range", min: "0", max: String(shots.length - 1), value: "0", "aria-label": "Number of queries" });
    range.addEventListener("input", () => choose(shots[range.value]));
    shots.forEach((shot, at) => shot.addEventListener("click", () => { range.value = at; }));
    row.querySelector("h3").after(element("label", { class: "steps" }, "fewer queries ", range, " more queries"));
  }

  /** Adds the photo with a picture over it to a sheet; pictures become buttons. */
  function wipe(sheet) {
    const [photo, ...shots] = sheet.querySelectorAll(".shot");
    const over = element("img", { alt: "" });
    const range = element("input", { type: "range", min: "0", max: "100", value: "50", "aria-label": "Where the picture begins" });
    const under = element("img", { src: photo.querySelector("img").src, alt: "" });
    const box = element("div", { class: "wipe", hidden: "" }, under, over, element("span", { class: "edge" }), range);
    const hint = element("p", { class: "hint", "aria-live": "polite" });
    const move = () => box.style.setProperty("--at", `${range.value}%`);
    const choose = (chosen) => {
      box.hidden = false;
      over.src = chosen.querySelector("img").src;
      hint.textContent = `Left the photo, right ${named(chosen)}.`;
      for (const shot of sheet.querySelectorAll(".shot")) shot.classList.toggle("chosen", shot === chosen);
      box.scrollIntoView({ block: "nearest" });
    };
    range.addEventListener("input", move);
    for (const shot of shots) {
      const button = element("button", { class: shot.className, type: "button" }, ...shot.childNodes);
      button.addEventListener("click", () => choose(button));
      shot.replaceWith(button);
    }
    for (const row of sheet.querySelectorAll("[data-by-queries]")) steps(row, choose);
    move();
    sheet.querySelector(".strip").after(box, hint);
  }

  Object.assign(window.Unlift, { chosen, wipe });
})();
