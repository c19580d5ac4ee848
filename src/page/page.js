"use strict";

const collator = new Intl.Collator("en", { numeric: true });

/** Sorts a heading's table by its column; the other way round if it is sorted by it already. */
function sort(heading) {
  const isNumber = heading.classList.contains("number");
  const was = heading.getAttribute("aria-sort");
  const ascending = was ? was === "descending" : !isNumber;
  for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
  heading.setAttribute("aria-sort", ascending ? "ascending" : "descending");

  const key = ({ cells: { [heading.cellIndex]: cell } }) =>
    isNumber ? Number(cell.dataset.value ?? -Infinity) : cell.textContent;
  const compare = isNumber ? (a, b) => (a < b ? -1 : Number(a > b)) : collator.compare;
  const [body] = heading.closest("table").tBodies;
  const rows = [...body.rows].map((row) => [key(row), row]);
  rows.sort(([a], [b]) => (ascending ? compare(a, b) : compare(b, a)));
  for (const [, row] of rows) body.append(row);
}

for (const heading of document.querySelectorAll("th")) {
  heading.querySelector("button").addEventListener("click", () => sort(heading));
}

// A slider shows one level of its figure.
for (const slider of document.querySelectorAll("input[type=range]")) {
  slider.addEventListener("input", () => {
    for (const part of slider.closest("figure").querySelectorAll("[data-level]")) {
      part.toggleAttribute("hidden", part.dataset.level !== slider.value);
    }
  });
}
