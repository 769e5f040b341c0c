"use strict";
const errors = [];
window.addEventListener("error", (e) => errors.push(e.message));

const data = JSON.parse(document.getElementById("data").textContent);
// Okabe and Ito (2008), as in the SVG figures; black would vanish on a dark page, so the last one is grey.
const colours = ["#D55E00", "#E69F00", "#F0E442", "#56B4E9", "#0072B2", "#CC79A7", "#009E73", "#888888"];
const byId = (id) => document.getElementById(id);

// Sorting: by number where every cell has one, else by text; a second click turns the order round.
function sortBy(header) {
  const column = header.cellIndex;
  const body = header.closest("table").tBodies[0];
  const down = header.getAttribute("aria-sort") === "ascending";
  for (const other of header.parentNode.cells) other.removeAttribute("aria-sort");
  header.setAttribute("aria-sort", down ? "descending" : "ascending");
  const key = (row) => row.cells[column].dataset.v ?? row.cells[column].textContent;
  const rows = [...body.rows];
  const numeric = rows.every((row) => row.cells[column].dataset.v !== undefined);
  const order = numeric ? (a, b) => key(a) - key(b) : (a, b) => key(a).localeCompare(key(b));
  rows.sort(order);
  if (down) rows.reverse();
  body.append(...rows);
}
for (const button of document.querySelectorAll(".sortable th button")) {
  button.addEventListener("click", () => sortBy(button.parentNode));
}

// The shape, from rest to fitted. y grows upwards in the data and downwards on the screen.
function draw() {
  const svg = byId("tongue");
  const shape = data.shapes.find((s) => s.fit === Number(byId("shape").value));
  if (!shape) return;
  const part = byId("slider").value / 100;
  byId("part").textContent = `${byId("slider").value} %`;
  const at = data.rest.map(([x, y], i) => [x + part * shape.moved[i][0], y + part * shape.moved[i][1]]);
  const lines = (points, pairs) => pairs.map(([a, b]) => `M${points[a][0]} ${-points[a][1]}L${points[b][0]} ${-points[b][1]}`).join("");
  const chain = (nodes) => "M" + nodes.map((n) => `${at[n][0]} ${-at[n][1]}`).join("L");
  const path = (kind, d, colour) => {
    const p = document.createElementNS("http://www.w3.org/2000/svg", "path");
    p.setAttribute("class", kind);
    p.setAttribute("d", d);
    if (colour) p.style.stroke = colour;
    return p;
  };
  const xs = data.rest.map((p) => p[0]), ys = data.rest.map((p) => -p[1]);
  const [left, top] = [Math.min(...xs), Math.min(...ys)];
  const [width, height] = [Math.max(...xs) - left, Math.max(...ys) - top];
  const margin = 0.15 * Math.max(width, height);
  svg.setAttribute("viewBox", [left - margin, top - margin, width + 2 * margin, height + 2 * margin].join(" "));
  const muscles = data.muscles.map((m, i) =>
    path(shape.active.includes(m.name) ? "active" : "passive", chain(m.nodes), colours[i % colours.length]));
  svg.replaceChildren(path("rest", lines(data.rest, data.connections)), path("mesh", lines(at, data.connections)), ...muscles);
}
byId("shape").addEventListener("change", draw);
byId("slider").addEventListener("input", draw);
draw();

byId("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = dark ? "light" : "dark";
});

// A link to a fit opens it.
function openTarget() {
  const target = location.hash.startsWith("#fit-") && document.querySelector(location.hash);
  if (target) target.open = true;
}
window.addEventListener("hashchange", openTarget);
openTarget();

// Opened as page.html#self-test the page tries its own controls and writes what it found into the document.
function selfTest() {
  const check = (holds, what) => { if (!holds) errors.push(what); };
  for (const table of document.querySelectorAll(".sortable")) {
    const column = [...table.tHead.rows[0].cells];
    for (const header of column) {
      const read = () => [...table.tBodies[0].rows].map((r) => r.cells[header.cellIndex].dataset.v ?? r.cells[header.cellIndex].textContent);
      const numeric = [...table.tBodies[0].rows].every((r) => r.cells[header.cellIndex].dataset.v !== undefined);
      const ordered = (v) => v.every((x, i) => i === 0 || (numeric ? v[i - 1] - x <= 0 : v[i - 1].localeCompare(x) <= 0));
      header.querySelector("button").click();
      check(ordered(read()), `${table.id} is not sorted by ${header.textContent}`);
      header.querySelector("button").click();
      check(ordered(read().reverse()), `${table.id} is not sorted downwards by ${header.textContent}`);
    }
  }
  if (data.shapes.length > 0) {
    const drawn = () => byId("tongue").querySelector(".mesh").getAttribute("d");
    const fitted = drawn();
    byId("slider").value = 0;
    byId("slider").dispatchEvent(new Event("input"));
    check(drawn() !== fitted, "the slider does not move the shape");
    check(drawn() === byId("tongue").querySelector(".rest").getAttribute("d"), "the slider does not reach rest");
    byId("slider").value = 100;
    const last = data.shapes[data.shapes.length - 1].fit;
    byId("shape").value = last;
    byId("shape").dispatchEvent(new Event("change"));
    check(data.shapes.length === 1 || drawn() !== fitted, "another fit shows the same shape");
    location.hash = `#fit-${last}`;
    openTarget();
    check(byId(`fit-${last}`).open, "a link does not open its fit");
  }
  const background = () => getComputedStyle(document.body).backgroundColor;
  const before = background();
  byId("theme").click();
  check(background() !== before, "the theme does not change");
  document.body.dataset.selfTest = errors.length === 0 ? "passed" : errors.join("; ");
}
if (location.hash === "#self-test") selfTest();
