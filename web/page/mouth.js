// The picture: tissue and muscles of the model in a mouth that is drawn for orientation. Millimetres, x to the back, y up.
const SVG = "http://www.w3.org/2000/svg";
const make = (name, attributes = {}, ...children) => {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
};
// Sets an attribute only if it has changed: browsers compute the layout again even for the same value.
const set = (node, name, value) => {
  const kept = (node.kept ??= {}), text = String(value);
  if (kept[name] !== text) node.setAttribute(name, kept[name] = text);
};
const put = (p) => `${p[0].toFixed(2)} ${(-p[1]).toFixed(2)}`;
const line = (points) => "M" + points.map(put).join("L");
// A smooth curve through all points (Catmull and Rom), closed or open.
function smooth(points, closed = true) {
  const n = points.length, at = (i) => points[closed ? (i + n) % n : Math.min(Math.max(i, 0), n - 1)];
  let d = "M" + put(points[0]);
  for (let i = 0; i < (closed ? n : n - 1); i++) {
    const [a, b, c, e] = [at(i - 1), at(i), at(i + 1), at(i + 2)];
    d += `C${put([b[0] + (c[0] - a[0]) / 6, b[1] + (c[1] - a[1]) / 6])} ${put([c[0] - (e[0] - b[0]) / 6, c[1] - (e[1] - b[1]) / 6])} ${put(c)}`;
  }
  return d + (closed ? "Z" : "");
}

// What is drawn for orientation; `jaw` turns with the mandible, `hyoid` shifts with the hyoid.
const DRAWN = {
  face: [[-26, 101], [-28, 91], [-34, 79], [-41, 70], [-44.5, 65.5], [-43, 62], [-38, 60], [-31.5, 58.5], [-30.5, 54], [-32, 48], [-34, 43], [-33.5, 39], [-30, 36], [-25.5, 34.6]],
  upperLipInside: [[-23.3, 36.5], [-22.6, 41], [-22.2, 48], [-20.5, 54]],
  lowerLipInside: [[-19.3, 13], [-20, 18.5], [-21.4, 25], [-24.5, 31]],
  chin: [[-25.5, 33.4], [-30, 32.4], [-32.4, 27.5], [-31.6, 20.5], [-28.5, 13.5], [-27.6, 8], [-30, 1], [-31.2, -6], [-29.5, -14], [-24, -20.5], [-15, -24]],
  throat: [[8, -24.5], [26, -25.5], [36, -29], [38, -40]],
  nose: [[-33, 62.6], [-26, 66], [-14, 67.5], [4, 68.5], [20, 69.5], [38, 69], [50, 68.5], [58, 65], [64, 57], [66, 65], [66, 77], [58, 85], [40, 89], [10, 89], [-14, 85], [-27, 75]],
  maxillaAbove: [[-17, 45], [-20.6, 47], [-21, 52], [-20.4, 57], [-22, 61], [-19, 63.6], [-10, 64.4], [2, 65.4], [16, 66.4], [28, 66.2], [34, 65], [33, 61.5]],
  velumAbove: [[33, 65], [41, 62], [49, 60.6], [57, 59], [63, 53.5], [66.2, 46]],
  upperTooth: [[-14.2, 42], [-16.4, 38.2], [-17.8, 34.6], [-18.6, 33.7], [-19.4, 34.6], [-21, 39], [-21.6, 43.5], [-20.6, 48.5], [-18.2, 54], [-16.8, 54.4], [-15.4, 49]],
  lowerTooth: [[-13.4, 18.1], [-15.7, 23.6], [-16.4, 27.7], [-17.1, 28.5], [-17.8, 27.7], [-18.9, 23.1], [-19.1, 18.1], [-18.1, 12.1], [-16.1, 6.5], [-15.1, 6.5], [-13.7, 12.1]],
  symphysis: [[-12.2, 15.6], [-9.6, 10], [-6.8, 4.6], [-2.6, 1.4], [0, 0.4], [0.4, -2.6], [-2, -8.6], [-6.4, -13.8], [-13, -16.8], [-19.6, -15], [-22.6, -9], [-22.2, -2], [-20.2, 4], [-19.4, 10], [-18.6, 14.6]],
  ramus: [[-4, -12], [14, -9], [34, -3], [50, 8], [57, 26], [62, 48], [66, 68], [67, 80], [70, 85], [74, 82], [74, 66], [71, 40], [68, 16], [58, -4], [42, -13], [20, -18], [-4, -16.6]],
  hyoidBone: [[35.6, -2.2], [39, -1.2], [44, -4.6], [49.4, -8.8], [49, -11.6], [45, -11.4], [39, -7.6], [35.4, -4.6]],
  epiglottis: [[45.6, -3], [50, 2], [52.6, 8], [53.8, 15], [53, 18.5], [51.4, 15.4], [49.6, 9], [47, 3.6], [44, -1]],
  backAbove: [[67, 78], [67, 62], [66.8, 46]],
  styloid: [[95, 99], [90, 94], [84, 84], [79.6, 76.6], [82.4, 81], [90, 90], [99, 96]],
};

const PLACES = [["nose", [18, 77]], ["palate", [12, 63.2]], ["soft palate", [49.5, 57]], ["pharynx", [57.5, 4]], ["lips", [-31, 41]], ["jaw", [-12.5, -5.5], "jaw"], ["hyoid", [42.5, -13.6], "hyoid"], ["styloid process", [77, 85.5]]];
// Place of a muscle's name along its line, and its distance from the line, mm.
const NAMES = { GGa: [0.4, -5], GGm: [0.72, -5], GGp: [0.6, 3.2], SGp: [0.5, 6.5], SGm: [0.5, -3.4], SGa: [0.45, 3.6], HGa: [0.55, -5], HGp: [0.8, -4.6] };

function makeMouth(svg, body) {
  const mm = (p) => [1e3 * p[0], 1e3 * p[1]];
  const rest = body.nodes_m.map(mm);
  const joint = body.joint_mm;
  const path = (kind, d = "") => make("path", { class: kind, d });
  const fixed = (kind, name, closed = true) => path(kind, smooth(DRAWN[name], closed));
  const own = body.palate_m === null;
  // The walls of the tract whose sound is computed, from the glottis to the upper teeth.
  const [larynx, pharynx, velum, vault, ridge] = own ? [] : body.tract.wall.map((w) => w.points_mm.map(([x, y]) => [x, y]));
  const backWall = own ? [] : [...pharynx.toReversed(), ...larynx.toReversed(), [52.4, -40]], roof = own ? [] : [...vault, ...ridge.slice(0, -1)];
  const soft = path("soft"), cavity = path("air"), wall = path("wall"), ghost = path("ghost"), symphysis = path("bone"), hyoid = path("bone");
  const epiglottis = path("soft"), lowerTooth = path("tooth"), tissue = path("tissue"), web = path("web"), was = path("was"), arrow = path("arrow");
  const edgesOf = (points) => body.edges.map(([a, b]) => `M${put(points[a])}L${put(points[b])}`).join("");
  const outline = (points) => body.outlines.map((loop) => smooth(loop.map((n) => points[n]))).join("");
  const muscles = body.muscles.map((m) => ({ ...m, edge: path("edge"), line: path("line"), text: make("text", {}, m.name) }));
  muscles.forEach((m) => { m.line.style.stroke = m.colour; m.text.append(make("title", {}, m.full_name)); });
  const palate = path("palate", own ? "" : line(body.palate_m.map(mm)));
  const pins = body.fixed.map(() => make("circle", { class: "pin", r: 1.25 }));
  const places = own ? [] : PLACES.map(([name, at, moves]) => ({ at, moves, text: make("text", { class: "place" }, name) }));
  const setting = own ? [] : [soft, fixed("air", "nose"), cavity, wall, ghost, path("soft", smooth([...DRAWN.velumAbove, ...velum])), path("bone", smooth([...roof, ...DRAWN.maxillaAbove])), fixed("bone", "styloid"),
    symphysis, hyoid, epiglottis, fixed("tooth", "upperTooth"), lowerTooth];
  was.setAttribute("d", outline(rest));
  const down = make("g", { hidden: "" }, arrow, make("text", { class: "place" }, "weight"));
  svg.replaceChildren(...svg.querySelectorAll("title, desc"), ...setting, tissue, web, was, palate, ...muscles.flatMap((m) => [m.edge, m.line]), ...pins,
    ...places.map((p) => p.text), ...muscles.map((m) => m.text), down);
  if (own) {
    const [xs, ys] = [0, 1].map((i) => rest.filter((_, n) => body.outlines.some((l) => l.includes(n))).map((p) => p[i]));
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const room = 0.2 * Math.max(right - left, high - low);
    svg.setAttribute("viewBox", [left - room, -high - room, right - left + 2 * room, high - low + 2 * room].join(" "));
  } else svg.setAttribute("viewBox", "-47 -91 141 121");

  // The places of the bones for which the setting is drawn.
  let carried = null;
  return function draw(at, tensions, bones, shown) {
    const points = rest.map((_, n) => [1e3 * at[2 * n], 1e3 * at[2 * n + 1]]);
    const turn = bones[0] * Math.PI / 180, [sin, cos] = [Math.sin(turn), Math.cos(turn)];
    const jaw = ([x, y]) => [joint[0] + cos * (x - joint[0]) - sin * (y - joint[1]), joint[1] + sin * (x - joint[0]) + cos * (y - joint[1])];
    const lift = ([x, y]) => [x + bones[1], y + bones[2]];
    if (!own && carried !== String([bones, shown.lips])) {
      carried = String([bones, shown.lips]);
      // The lips are opened as asked; each lip opens half of what the jaw does not open.
      const open = shown.lips[0] - (DRAWN.face.at(-1)[1] - jaw(DRAWN.chin[0])[1]), out = -shown.lips[1];
      const lip = (parts, by) => ([x, y], i, all) => { const part = parts(i, all.length); return [x + out * part, y + by * part]; };
      const lips = DRAWN.face.map(lip((i, n) => Math.max(0, 1 - (n - 1 - i) / 6), open / 2)), upper = DRAWN.upperLipInside.map(lip((i, n) => 1 - i / n, open / 2));
      const chin = DRAWN.chin.map(jaw).map(lip((i) => Math.max(0, 1 - i / 4), -open / 2)), inside = DRAWN.lowerLipInside.map(jaw).map(lip((i, n) => i / (n - 1), -open / 2));
      const floor = [jaw([-12, 15]), jaw([-2, 1]), lift([38, -4])];
      set(soft, "d", smooth([...lips, ...upper, ...inside.slice().reverse(), ...chin], false)
        + "L" + [...DRAWN.throat.map((p, i) => i === 0 ? jaw(p) : i < 3 ? lift(p) : p)].map(put).join("L") + "L110 50L110 -110L-25 -110Z");
      // The air in the mouth: lips, palate, soft palate, pharynx, and the floor of the mouth.
      set(cavity, "d", line([lips.at(-1), ...upper, ...roof.toReversed(), ...velum.toReversed(), ...backWall, [38, -40], lift([46.4, -16.7]), lift([49, -12]), lift([47, -8]), floor[2], floor[1], floor[0], ...inside, chin[0]]) + "Z");
      set(wall, "d", smooth([...DRAWN.backAbove, ...backWall], false));
      set(ghost, "d", smooth(DRAWN.ramus.map(jaw)));
      set(symphysis, "d", smooth(DRAWN.symphysis.map(jaw)));
      set(lowerTooth, "d", smooth(DRAWN.lowerTooth.map(jaw)));
      set(hyoid, "d", smooth(DRAWN.hyoidBone.map(lift)));
      set(epiglottis, "d", smooth(DRAWN.epiglottis.map(lift)));
      for (const p of places) {
        const [x, y] = p.moves === "jaw" ? jaw(p.at) : p.moves === "hyoid" ? lift(p.at) : p.at;
        set(p.text, "transform", `translate(${put([x, y])})`);
      }
    }
    set(tissue, "d", outline(points));
    set(web, "d", shown.mesh ? edgesOf(points) : "");
    set(palate, "class", shown.palate ? "palate on" : "palate");
    muscles.forEach((m, i) => {
      const d = line(m.nodes.map((n) => points[n])), pulls = tensions[i] > 0.05;
      const width = pulls ? 1.1 + 1.5 * Math.sqrt(Math.min(tensions[i], 100) / 100) : 0.8;
      for (const [kind, wide] of [["edge", width + (pulls ? 0.7 : 0.45)], ["line", width]]) {
        const node = m[kind];
        set(node, "d", d);
        set(node, "stroke-width", wide);
        set(node, "class", `${kind}${pulls ? "" : " slack"}`);
      }
      const [a, b] = [points[m.nodes[0]], points[m.nodes.at(-1)]];
      const [t, beside] = NAMES[m.name] ?? [0.5 + 0.08 * (i % 4), 3.5];
      const way = [b[0] - a[0], b[1] - a[1]], long = Math.hypot(...way) || 1;
      set(m.text, "transform", `translate(${put([a[0] + t * way[0] - beside * way[1] / long, a[1] + t * way[1] + beside * way[0] / long])})`);
      set(m.text, "class", pulls ? "strong" : "");
    });
    body.fixed.forEach((n, i) => { set(pins[i], "cx", points[n][0].toFixed(2)); set(pins[i], "cy", (-points[n][1]).toFixed(2)); });
    const way = { upright: [0, -1], supine: [1, 0], prone: [-1, 0] }[shown.gravity];
    down.toggleAttribute("hidden", !way);
    down.style.display = way ? "" : "none";
    if (way) {
      const c = [82, 8], [u, v] = way, tip = [c[0] + 8 * u, c[1] + 8 * v];
      set(arrow, "d", `${line([[c[0] - 6 * u, c[1] - 6 * v], tip])}${line([tip, [tip[0] - 3 * u - 1.6 * v, tip[1] - 3 * v + 1.6 * u], [tip[0] - 3 * u + 1.6 * v, tip[1] - 3 * v - 1.6 * u]])}Z`);
      set(down.lastChild, "x", c[0]);
      set(down.lastChild, "y", -(c[1] - (u ? 5 : 12)));
    }
  };
}

// The picture as a file of its own: it contains the page's styles, a title, the active muscles and loads, and a scale.
function pictureText(svg, made, { title, lines }) {
  const copy = svg.cloneNode(true), [from, to] = [svg, copy].map((s) => s.querySelectorAll("path, circle, text"));
  const kept = ["fill", "stroke", "stroke-width", "stroke-dasharray", "stroke-linecap", "stroke-linejoin", "opacity", "paint-order", "font-size", "font-style", "font-weight", "font-family", "text-anchor", "dominant-baseline", "display"];
  from.forEach((node, i) => {
    const style = getComputedStyle(node);
    to[i].removeAttribute("class");
    to[i].setAttribute("style", kept.filter((k) => style.getPropertyValue(k) !== "").map((k) => `${k}:${style.getPropertyValue(k)}`).join(";"));
  });
  const [x, top, width, inside] = svg.getAttribute("viewBox").split(" ").map(Number);
  const wrapped = lines.flatMap((said) => said.match(/.{1,88}(?:\s|$)/g) ?? [said]);
  const [y, height] = [top - 9, inside + 11 + 4.6 * wrapped.length];
  const said = (at, text, size) => make("text", { x: at[0], y: at[1], style: `font: ${size}px system-ui, sans-serif; fill: ${getComputedStyle(document.body).color}` }, text);
  const bar = { x1: x + width - 14, x2: x + width - 4, y1: top + inside - 4, y2: top + inside - 4, stroke: getComputedStyle(document.body).color, "stroke-width": 0.8 };
  const frame = make("svg", { viewBox: `${x} ${y} ${width} ${height}`, width: 8 * width, height: 8 * height });
  Object.entries({ x, y: top, width, height: inside }).forEach(([name, value]) => copy.setAttribute(name, value));
  frame.append(make("title", {}, title), make("metadata", {}, made), make("rect", { x, y, width, height, fill: getComputedStyle(document.body).backgroundColor }), copy,
    said([x + 3, y + 6], title, 4.4), make("line", bar), said([x + width - 13.5, top + inside - 5.5], "10 mm", 3), ...wrapped.map((line, i) => said([x + 3, top + inside + 5 + 4.6 * i], line, 3)));
  copy.insertBefore(make("rect", { x, y: top, width, height: inside, fill: getComputedStyle(svg).backgroundColor }), copy.children[2]);
  for (const name of ["id", "aria-labelledby"]) copy.removeAttribute(name);
  return new XMLSerializer().serializeToString(frame);
}
