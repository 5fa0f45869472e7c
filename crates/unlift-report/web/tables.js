// Sorts a table by a column that the reader chooses.
"use strict";

(() => {
  const number = (text) => parseFloat(text.replace(/[,≤]/g, ""));

  /** Compares two cells: numbers before words, numbers by value. */
  function compare(a, b) {
    const [x, y] = [number(a), number(b)];
    if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y) || a.localeCompare(b);
    return x - y;
  }

  /** Makes the heads of a table sort it: first ascending for words, descending for figures. */
  function sortable(table) {
    const body = table.tBodies[0];
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const figures = head.classList.contains("figure");
        const falling = head.ariaSort ? head.ariaSort === "ascending" : figures;
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", falling ? "descending" : "ascending");
        const rows = [...body.rows];
        rows.sort((a, b) => (falling ? -1 : 1) * compare(a.cells[column].textContent, b.cells[column].textContent));
        body.replaceChildren(...rows);
        table.classList.add("sorted");
      });
    });
  }

  Object.assign(window.Unlift, { sortable });
})();
