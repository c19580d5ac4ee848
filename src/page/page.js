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
for (const slider of document.querySelectorAll(".plan input[type=range]")) {
  slider.addEventListener("input", () => {
    for (const part of slider.closest("figure").querySelectorAll("[data-level]")) {
      part.toggleAttribute("hidden", part.dataset.level !== slider.value);
    }
  });
}

// The dot of a chart that is nearest to the pointer is told.
for (const chart of document.querySelectorAll(".chart")) {
  const [svg, told] = [chart.querySelector("svg"), chart.querySelector("output")];
  svg.addEventListener("pointermove", ({ clientX, clientY }) => {
    const { x, y } = new DOMPoint(clientX, clientY).matrixTransform(svg.getScreenCTM().inverse());
    const away = (dot) => Math.hypot(dot.cx.baseVal.value - x, dot.cy.baseVal.value - y);
    const dots = [...svg.querySelectorAll("circle")].sort((a, b) => away(a) - away(b));
    dots.forEach((dot, i) => dot.classList.toggle("near", i === 0));
    told.textContent = dots[0]?.querySelector("title").textContent ?? "";
  });
}

/** Lays two pictures of a figure over each other, under a slider. */
function wipe(figure) {
  const shots = [...figure.querySelectorAll(".shots img")];
  const element = (name, properties) => Object.assign(document.createElement(name), properties);
  const stage = element("div", { className: "stage" });
  const [under, over] = [element("img", { alt: "" }), element("img", { alt: "" })];
  const edge = element("span");
  stage.append(under, over, edge);
  const slider = element("input", { type: "range", max: 1000, value: 500, ariaLabel: "share of the left picture" });
  const options = () => shots.map((shot, i) => element("option", { value: i, textContent: shot.alt }));
  const [left, right] = ["left picture", "right picture"].map((ariaLabel) => element("select", { ariaLabel }));
  left.append(...options());
  right.append(...options());
  [left.value, right.value] = [0, shots.length - 1];

  const show = () => {
    [under.src, over.src] = [shots[left.value].src, shots[right.value].src];
    const share = slider.value / 10;
    over.style.clipPath = `inset(0 0 0 ${share}%)`;
    edge.style.left = `${share}%`;
  };
  const drag = ({ clientX, buttons, type }) => {
    if (type !== "pointerdown" && !buttons) return;
    const { x, width } = stage.getBoundingClientRect();
    slider.value = (1000 * (clientX - x)) / width;
    show();
  };
  [left, right, slider].forEach((input) => input.addEventListener("input", show));
  stage.addEventListener("pointerdown", drag);
  stage.addEventListener("pointermove", drag);
  const chosen = element("div", { className: "chosen" });
  chosen.append(left, slider, right);
  figure.prepend(stage, chosen);
  show();
}

document.querySelectorAll(".wipe").forEach(wipe);
