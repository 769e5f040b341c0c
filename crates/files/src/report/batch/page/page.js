"use strict";
const errors = [];
window.addEventListener("error", (e) => errors.push(e.message));

const data = JSON.parse(document.getElementById("data").textContent);
// As in the SVG figures; black would vanish on a dark page, so it is grey.
const colour = (muscle) => muscle.colour === "#000000" ? "#888888" : muscle.colour;
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
  // The tongue fills the view, which is the same for every fit; lines to bones beyond it are cut off.
  const [left, top, width, height] = data.view;
  svg.setAttribute("viewBox", data.view.join(" "));
  svg.style.aspectRatio = `${width} / ${height}`;
  const muscles = data.muscles.map((m) =>
    path(shape.active.includes(m.name) ? "active" : "passive", chain(m.nodes), colour(m)));
  // Each name beside its line, at the first place that is in view and away from the others.
  const placed = [];
  const inside = ([x, y]) => x > left + 0.05 * width && x < left + 0.95 * width && y > top + 0.03 * height && y < top + 0.97 * height;
  const names = data.muscles.map((m) => {
    const [first, last] = [at[m.nodes[0]], at[m.nodes[m.nodes.length - 1]]];
    const spots = [0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.9, 0.95].map((t) =>
      [first[0] + t * (last[0] - first[0]) + 0.045 * width, -first[1] - t * (last[1] - first[1])]);
    const free = ([x, y]) => placed.every(([a, b]) => Math.abs(x - a) > 0.1 * width || Math.abs(y - b) > 0.05 * height);
    const spot = spots.find((s) => inside(s) && free(s)) ?? spots.find(inside) ?? spots[0];
    placed.push(spot);
    const text = document.createElementNS("http://www.w3.org/2000/svg", "text");
    text.setAttribute("x", spot[0]);
    text.setAttribute("y", spot[1]);
    text.style.fontSize = `${0.028 * width}px`;
    if (shape.active.includes(m.name)) text.style.fontWeight = "bold";
    text.textContent = m.name;
    return text;
  });
  svg.replaceChildren(path("rest", lines(data.rest, data.connections)), path("mesh", lines(at, data.connections)), ...muscles, ...names);
}
byId("shape").addEventListener("change", draw);
byId("slider").addEventListener("input", draw);
draw();

// Every figure can be kept as a file of its own.
for (const figure of document.querySelectorAll(".figure")) {
  const svg = figure.querySelector("svg");
  const save = document.createElement("a");
  save.className = "save";
  save.textContent = "SVG";
  save.download = `${svg.querySelector("title").textContent.replace(/[^\p{L}\p{N}]+/gu, "-")}.svg`;
  save.href = `data:image/svg+xml,${encodeURIComponent(svg.outerHTML)}`;
  figure.append(save);
}

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
    check(byId("tongue").querySelectorAll("text").length === data.muscles.length, "not every muscle is named");
    location.hash = `#fit-${last}`;
    openTarget();
    check(byId(`fit-${last}`).open, "a link does not open its fit");
  }
  for (const save of document.querySelectorAll(".figure .save")) {
    const text = decodeURIComponent(save.href.slice(save.href.indexOf(",") + 1));
    const file = new DOMParser().parseFromString(text, "image/svg+xml");
    check(file.documentElement.tagName === "svg" && save.download.length > 4, "a figure cannot be kept");
  }
  check(document.querySelectorAll(".figure .save").length === document.querySelectorAll(".figure").length, "a figure has no link");
  const background = () => getComputedStyle(document.body).backgroundColor;
  const before = background();
  byId("theme").click();
  check(background() !== before, "the theme does not change");
  document.body.dataset.selfTest = errors.length === 0 ? "passed" : errors.join("; ");
}
if (location.hash === "#self-test") selfTest();
