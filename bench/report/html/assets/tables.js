"use strict";
// Tables that are sorted by a click on a column's title, or Enter there.

function makeSortable(table) {
  const titles = [...table.tHead.rows[0].cells];
  titles.forEach((title, column) => {
    const button = element("button", { type: "button" }, title.textContent);
    title.replaceChildren(button);
    title.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const order = title.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
      titles.forEach((other) => other.setAttribute("aria-sort", other === title ? order : "none"));
      sortRows(table.tBodies[0], column, title.classList.contains("number"), order);
    });
  });
}

/** Rows without a number stay last in either order. */
function sortRows(body, column, numeric, order) {
  const sign = order === "ascending" ? 1 : -1;
  const keyOf = (row) => {
    const cell = row.cells[column];
    if (!numeric) return cell.textContent.trim();
    return cell.dataset.value === undefined ? null : Number(cell.dataset.value);
  };
  const compare = (a, b) => {
    if (a === null || b === null) return (a === null) - (b === null);
    return sign * (numeric ? a - b : a.localeCompare(b, undefined, { numeric: true }));
  };
  const rows = [...body.rows].map((row) => [keyOf(row), row]);
  rows.sort(([a], [b]) => compare(a, b));
  body.append(...rows.map(([, row]) => row));
}
