// Lays a picture over its photo, with an edge that is moved.
"use strict";

(() => {
  const { element } = window.Unlift;

  /** The name of a picture, as it stands below it and above its row. */
  function named(shot) {
    const row = shot.closest(".strip").previousElementSibling;
    const label = shot.closest("figure").querySelector("strong").textContent;
    return row?.tagName === "H3" ? `${row.textContent}, ${label}` : label;
  }

  /** Adds to a sheet the photo with a picture over it; pictures become buttons that choose. */
  function wipe(sheet) {
    const [photo, ...shots] = sheet.querySelectorAll(".shot");
    const over = element("img", { alt: "" });
    const range = element("input", { type: "range", min: "0", max: "100", value: "50", "aria-label": "Where the picture begins" });
    const under = element("img", { src: photo.querySelector("img").src, alt: "" });
    const box = element("div", { class: "wipe" }, under, over, element("span", { class: "edge" }), range);
    const hint = element("p", { class: "hint", "aria-live": "polite" });
    const move = () => box.style.setProperty("--at", `${range.value}%`);
    const choose = (chosen) => {
      over.src = chosen.querySelector("img").src;
      hint.textContent = `Left the photo, right ${named(chosen)}.`;
      for (const shot of sheet.querySelectorAll(".shot")) shot.classList.toggle("chosen", shot === chosen);
    };
    range.addEventListener("input", move);
    const buttons = shots.map((shot) => {
      const button = element("button", { class: shot.className, type: "button" }, ...shot.childNodes);
      button.addEventListener("click", () => {
        choose(button);
        box.scrollIntoView({ block: "nearest" });
      });
      shot.replaceWith(button);
      return button;
    });
    move();
    choose(buttons.find((button) => button.closest(".today")) ?? buttons.at(-1));
    sheet.querySelector(".strip").after(box, hint);
  }

  Object.assign(window.Unlift, { wipe });
})();
