// The tongue in space, turned by hand: the faces of its surface are painted from the farthest to the nearest, then the fibres of the active
// muscles, palate and jaw. Millimetres, x to the back, y to the right, z up.
const SOLID_NAMES = { GGP: "genioglossus, posterior", GGM: "genioglossus, middle", GGA: "genioglossus, anterior", STY: "styloglossus", GH: "geniohyoid", MH: "mylohyoid", HG: "hyoglossus", VERT: "verticalis", TRANS: "transversus", IL: "inferior longitudinal", SL: "superior longitudinal" };
// Colours of the muscles as in the program's pictures (Tol 2021), and of tissue without an active muscle.
const SOLID_COLOURS = [[204, 102, 119], [51, 34, 136], [221, 204, 119], [17, 119, 51], [136, 204, 238], [136, 34, 85], [68, 170, 153], [153, 153, 51], [170, 68, 153], [119, 170, 221], [238, 136, 102]];
const SOLID_TISSUE = [214, 205, 205], SOLID_BONE = [226, 216, 180], SOLID_ACTIVE = 5e-3, SOLID_ROOM = [56, 50];
const rgb = (colour, light) => `rgb(${colour.map((c) => Math.round(c * (0.58 + 0.42 * Math.max(0, light)))).join(" ")})`;
// Signs of the local coordinates of the corners of a hexahedron, over 8.
const CORNERS = [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]].map((c) => c.map((x) => x / 8));
// The mandible, drawn for orientation: its lower border from the chin to the joint (x, half of its width, z), and its row of teeth.
const MANDIBLE = [[-22, 0, -6], [-20, 9, -7], [-8, 20, -9], [14, 31, -8], [34, 39, -3], [50, 43, 7], [58, 46, 26], [63, 48, 48], [70, 50, 80]];
const LOWER_TEETH = [[-17.1, 0, 28.5], [-14, 9, 28], [-4, 17, 26.5], [10, 23, 25], [24, 26, 24]];

// `walls` are those of the tract, of which the palate and the upper teeth are drawn.
function makeSolid(canvas, body, walls) {
  const context = canvas.getContext("2d");
  const rest = body.rest_um;
  const shown = [...new Set(body.faces.concat(body.cut_faces).flatMap((f) => f.nodes))];
  const range = (i) => shown.reduce(([low, high], n) => [Math.min(low, rest[3 * n + i]), Math.max(high, rest[3 * n + i])], [Infinity, -Infinity]);
  const centre = [0, 1, 2].map((i) => { const [low, high] = range(i); return (low + high) / 2e3; });
  const mm = (um, n) => [um[3 * n] / 1e3, um[3 * n + 1] / 1e3, um[3 * n + 2] / 1e3];
  const bones = body.bones.map((b) => ({ name: b.name, nodes: new Set(b.nodes) }));
  const isRight = body.hexahedra.map((h) => h.reduce((sum, n) => sum + rest[3 * n + 1], 0) > 0);
  for (const face of body.faces.concat(body.cut_faces)) face.bone = bones.some((b) => face.nodes.every((n) => b.nodes.has(n)));
  // Palate and upper teeth: at each place a parabola across, as high as the wall's arch.
  const mix = ([a, b], t) => a + (b - a) * t;
  const arches = walls.filter((w) => /palate|teeth/.test(w.name)).flatMap((w) => w.points_mm.map(([x, z, ax, az], i, all) => {
    const t = i / Math.max(all.length - 1, 1), [half, arch] = [mix(w.half_width_mm, t), mix(w.arch_mm, t)], long = Math.hypot(ax - x, az - z);
    return [-1, -0.75, -0.5, -0.25, 0, 0.25, 0.5, 0.75, 1].map((y) => [x + (ax - x) / long * arch * y * y, half * y, z + (az - z) / long * arch * y * y]);
  }));
  // Below the middle of a bone.
  const under = (name) => { const places = body.bones.find((b) => b.name === name).nodes.map((n) => mm(rest, n)); return [0, 1, 2].map((i) => places.reduce((sum, p) => sum + p[i], 0) / places.length - (i === 2 ? 5 : 0)); };
  const along = (i) => arches.map((arch) => arch[i]);
  const bothSides = (points) => [...points.slice(1).toReversed().map(([x, y, z]) => [x, -y, z]), ...points];
  // Points, mm, and width of what is drawn beside the tongue.
  const SETTING = [...arches.map((points) => [points, 0.25]), ...[0, 4, 8].map((i) => [along(i), i === 4 ? 0.9 : 0.45]), [bothSides(MANDIBLE), 0.7], [bothSides(LOWER_TEETH), 0.45]];
  const WORDS = [["palate", along(4)[3]], ["upper teeth", along(4).at(-1)], ["jaw", [-8, -20, -9]], ["hyoid", under("hyoid")]];
  const AXES = [["front", [-1, 0, 0]], ["right", [0, 1, 0]], ["up", [0, 0, 1]]];
  // The present shape, the shape at rest as it is seen, and the view.
  let at = rest, ghost = {};
  // The light comes from above and from the viewer's left, in the axes of the picture.
  const [LEFT, ABOVE, NEAR] = [-0.45, -0.45, 0.77];
  // From millimetres to the picture: x to the right, y downwards, and the depth towards the viewer. At a turn of 0 degrees the speaker's
  // left side is seen, at 90 degrees the front.
  function camera([turn, tilt]) {
    const [sa, ca, sb, cb] = [turn, tilt].flatMap((d) => [Math.sin(d * Math.PI / 180), Math.cos(d * Math.PI / 180)]);
    return ([x, y, z]) => { const away = sa * x + ca * y; return [ca * x - sa * y, -(sb * away + cb * z), sb * z - cb * away]; };
  }
  const from = (p) => [p[0] - centre[0], p[1] - centre[1], p[2] - centre[2]];
  // The faces that are turned to the viewer, the farthest first, with their colours.
  function faces(um, turned, cut, activations) {
    const seen = [];
    for (const n of shown) seen[n] = turned(from(mm(um, n)));
    const found = [];
    for (const { nodes, muscles, bone } of cut ? body.cut_faces : body.faces) {
      const [a, b, c, d] = nodes.map((n) => seen[n]);
      const [ux, uy, uz, vx, vy, vz] = [c[0] - a[0], c[1] - a[1], c[2] - a[2], d[0] - b[0], d[1] - b[1], d[2] - b[2]];
      // Counter-clockwise as seen from outside, where y points downwards.
      const normal = [vy * uz - uy * vz, vz * ux - uz * vx, vx * uy - ux * vy];
      if (normal[2] <= 0) continue;
      let most = -1;
      for (const m of muscles) if (activations[m] > (activations[most] ?? SOLID_ACTIVE)) most = m;
      const colour = bone ? SOLID_BONE : most < 0 ? SOLID_TISSUE : SOLID_TISSUE.map((c, i) => 0.55 * c + 0.45 * SOLID_COLOURS[most][i]);
      const light = (LEFT * normal[0] + ABOVE * normal[1] + NEAR * normal[2]) / (Math.hypot(...normal) || 1);
      found.push({ points: [a, b, c, d], depth: a[2] + b[2] + c[2] + d[2], fill: rgb(colour, light) });
    }
    return found.sort((a, b) => a.depth - b.depth);
  }
  // The fibres of the active muscles through all elements, also those inside: points, colour and width.
  function fibres(turned, cut, activations) {
    return body.muscles.flatMap((_, m) => {
      if (!(activations[m] > SOLID_ACTIVE)) return [];
      const width = 0.35 + 0.75 * Math.sqrt(activations[m]), colour = rgb(SOLID_COLOURS[m], 1);
      const within = body.fibres[m].flatMap(([element, ...half]) => {
        if (cut && !isRight[element]) return [];
        const [middle, way] = [[0, 0, 0], [0, 0, 0]];
        body.hexahedra[element].forEach((n, i) => {
          const by = CORNERS[i][0] * half[0] + CORNERS[i][1] * half[1] + CORNERS[i][2] * half[2];
          for (let k = 0; k < 3; k++) { middle[k] += at[3 * n + k] / 8e3; way[k] += by * at[3 * n + k] / 1e3; }
        });
        return [[-1, 1].map((end) => turned(from(middle.map((x, k) => x + end * way[k]))))];
      });
      const outside = body.lines[m].filter(([, n]) => !cut || rest[3 * n + 1] > 0).map((ends) => ends.map((n) => turned(from(mm(at, n)))));
      return [...within, ...outside].map((points) => ({ points, colour, width }));
    });
  }
  // Lines and names beside the tongue, and the directions in the lower corner.
  function setting(turned) {
    const corner = [-SOLID_ROOM[0] + 15, SOLID_ROOM[1] - 10];
    const tips = AXES.map(([name, axis]) => [name, turned(axis)]);
    return {
      lines: [...SETTING.map(([points, width]) => ({ points: points.map((p) => turned(from(p))), width })), ...tips.map(([, [x, y]]) => ({ points: [corner, [corner[0] + 7 * x, corner[1] + 7 * y]], width: 0.6 }))],
      words: [...WORDS.map(([name, p]) => [name, turned(from(p))]), ...tips.filter(([, [x, y]]) => Math.hypot(x, y) > 0.35).map(([name, [x, y]]) => [name, [corner[0] + 9.5 * x, corner[1] + 9.5 * y]])],
    };
  }
  return {
    body,
    moved(micrometres) { at = micrometres; },
    positions_um: () => at,
    draw({ view, cut, activations }) {
      const fine = Math.min(devicePixelRatio || 1, 2), [wide, high] = [canvas.clientWidth * fine, canvas.clientHeight * fine].map(Math.round);
      if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, wide, high);
      const scale = Math.min(wide / SOLID_ROOM[0], high / SOLID_ROOM[1]) / 2;
      context.setTransform(scale, 0, 0, scale, wide / 2, high / 2);
      context.lineJoin = context.lineCap = "round";
      const { color, backgroundColor } = getComputedStyle(canvas), turned = camera(view);
      const trace = (points) => points.forEach(([x, y], i) => i ? context.lineTo(x, y) : context.moveTo(x, y));
      const stroke = ({ points, width, colour }) => { context.beginPath(); trace(points); context.lineWidth = width; context.strokeStyle = colour; context.stroke(); };
      const key = `${view} ${cut}`;
      if (ghost.key !== key) ghost = { key, faces: faces(rest, turned, cut, []) };
      context.fillStyle = "rgb(128 128 128 / .2)";
      context.beginPath();
      for (const face of ghost.faces) { trace(face.points); context.closePath(); }
      context.fill();
      for (const face of faces(at, turned, cut, activations)) {
        context.beginPath();
        trace(face.points);
        context.closePath();
        context.fillStyle = face.fill;
        context.fill();
        context.strokeStyle = "#4a4a4a";
        context.lineWidth = 1 / scale;
        context.stroke();
      }
      for (const fibre of fibres(turned, cut, activations)) stroke(fibre);
      const { lines, words } = setting(turned);
      context.globalAlpha = 0.7;
      for (const beside of lines) stroke({ ...beside, colour: color });
      context.globalAlpha = 1;
      Object.assign(context, { font: "3.4px system-ui, sans-serif", textAlign: "center", textBaseline: "middle", lineWidth: 1, strokeStyle: backgroundColor, fillStyle: color });
      for (const [word, [x, y]] of words) { context.strokeText(word, x, y); context.fillText(word, x, y); }
    },
    // The same picture as an element of SVG.
    picture({ view, cut, activations }) {
      const [wide, high] = SOLID_ROOM, turned = camera(view), { lines, words } = setting(turned);
      const d = (points) => `M${points.map((p) => `${p[0].toFixed(2)} ${p[1].toFixed(2)}`).join("L")}`;
      const path = ({ points, colour = "currentColor", width }) => make("path", { d: d(points), fill: "none", stroke: colour, "stroke-width": width.toFixed(2), "stroke-linecap": "round" });
      return make("svg", { viewBox: `${-wide} ${-high} ${2 * wide} ${2 * high}` }, make("title", {}, "A tongue in space"), make("desc", {}, "Surface, fibres of the active muscles, palate and jaw"),
        ...faces(at, turned, cut, activations).map((f) => make("path", { d: `${d(f.points)}Z`, fill: f.fill, stroke: "#4a4a4a", "stroke-width": 0.25, "stroke-linejoin": "round" })),
        ...fibres(turned, cut, activations).map(path), ...lines.map(path),
        ...words.map(([word, [x, y]]) => make("text", { x: x.toFixed(2), y: y.toFixed(2), fill: "currentColor", "font-size": "3.4px", "text-anchor": "middle", "dominant-baseline": "middle" }, word)));
    },
  };
}

// -- Sliders, texts and solves ------------------------------------------------------------------------------------------------------
// Newton iterations for each picture while activations change, and the number of pictures without an equilibrium after which the branch from
// rest is followed.
const FEW = 2, PATIENT = 40;
let pulling = false, resting = false, pulled = 0, repaint = false;
const solidRows = [], paints = [];
// The user's own body has no shape in space.
const hasOwnBody = () => Boolean(own.body?.anatomy ?? own.body?.mesh);
async function enterSpace() {
  if (!solid) {
    const made = await worker({ ask: "open_space" });
    if (made.ended) return enterSpace();
    complain("space", made.error);
    if (made.error) return false;
    solid = makeSolid(byId("solid"), made, body.tract?.wall ?? []);
    byId("solid").setAttribute("aria-label", "Tongue in space");
    state.activations = made.muscles.map((_, i) => state.activations[i] ?? 0);
    makeSolidRows();
  }
  state.space = true;
  // The voice is that of the tongue in the plane, and so are its controls.
  if (sound.playing()) sound.toggle();
  for (const id of ["found", "speed"]) byId(id).textContent = "";
  showControls();
  pullInSpace();
  return true;
}
function makeSolidRows() {
  byId("solid-rows").replaceChildren(...solid.body.muscles.map((name, i) => {
    const slider = element("input", { type: "range", min: 0, max: 1, step: 0.01, id: `act-${i}` }), number = element("output", { htmlFor: slider.id });
    const mark = make("svg", { viewBox: "0 0 14 14", "aria-hidden": "true" }, make("rect", { x: 1, y: 1, width: 12, height: 12, rx: 2, fill: rgb(SOLID_COLOURS[i], 1), stroke: "currentColor" }));
    slider.setAttribute("aria-label", `Activation of ${name}, ${SOLID_NAMES[name]}`);
    slider.addEventListener("input", () => { state.activations[i] = Number(slider.value); showSolidControls(); pullInSpace(); });
    solidRows.push({ slider, number });
    return element("div", { className: "row" }, element("label", { htmlFor: slider.id, title: SOLID_NAMES[name] }, mark, name), slider, number, element("span", { className: "who", textContent: SOLID_NAMES[name] }));
  }));
}
function showSolidControls() {
  solidRows.forEach((row, i) => {
    renew(row.slider, "value", String(state.activations[i]));
    renew(row.number, "textContent", round(state.activations[i], 2));
  });
  ["turn", "tilt"].forEach((id, i) => {
    renew(byId(id), "value", String(Math.round(state.view[i])));
    renew(byId(`${id}-out`), "textContent", `${Math.round(state.view[i])} °`);
  });
  byId("cut").checked = state.cut;
}
function paint() {
  if (repaint) return;
  repaint = true;
  requestAnimationFrame((now) => {
    repaint = false;
    if (!state.space) return;
    solid.draw(state);
    paints.push(now);
    while (paints.length > 60 || now - paints[0] > 1000) paints.shift();
  });
}
function turnTo(turn, tilt) {
  state.view = [(turn + 540) % 360 - 180, Math.min(90, Math.max(-90, tilt))];
  showSolidControls();
  paint();
  clearTimeout(idle);
  idle = setTimeout(() => { idle = 0; remember(); }, 180);
}
// Continues towards the equilibrium of the present activations, with a few iterations for each picture.
async function pullInSpace() {
  const mine = ++pulled;
  if (pulling) return;
  pulling = true;
  let [of, tries, next] = [mine, 0, null];
  while (tries++ < PATIENT) {
    const clock = performance.now();
    next = await worker({ ask: "move_in_space", activations: state.activations, iterations: FEW });
    if (next.ended) continue;
    if (next.error || !state.space) break;
    solid.moved(next.positions_um);
    paint();
    if (performance.now() - told > 100) {
      told = performance.now();
      const rate = paints.length > 5 ? `, ${Math.round(1000 * (paints.length - 1) / (paints.at(-1) - paints[0]))} pictures/s` : "";
      byId("speed").textContent = `${FEW} iterations in ${round(told - clock, 0)} ms${rate}`;
      byId("found").textContent = next.status === "converged" ? "" : `Not yet at equilibrium: forces of up to ${next.residual_n.toPrecision(1)} N remain.`;
    }
    if (pulled !== of) [of, tries] = [pulled, 0];
    else if (next.status === "converged") break;
  }
  pulling = false;
  complain("space", next?.error);
  if (!next?.error && state.space) rest(pulled); else resting = false;
}
// When nothing moves, the same activations are solved from rest, as the program solves them.
async function rest(of) {
  resting = true;
  await new Promise((done) => setTimeout(done, 180));
  const found = of === pulled ? await thinkers[0]({ ask: "settle_in_space", activations: state.activations }) : null;
  if (of !== pulled) return;
  resting = false;
  if (found.ended) { if (state.space) pullInSpace(); return; }
  remember();
  complain("space", found.error);
  if (found.error || !state.space) return;
  solid.moved(found.positions_m.flat().map((x) => 1e6 * x));
  paint();
  const [back, , up] = found.foremost_moved_mm;
  const doubts = found.alarms.map((a) => a.text);
  byId("found").textContent = found.status === "converged"
    ? `Equilibrium${found.connection === "traced" ? ", followed from rest" : ""}: the tip moved ${way(back, ["forward", "back"])} and ${way(up, ["down", "up"])}; elements keep ${round(100 * found.min_volume_ratio)} to ${round(100 * found.max_volume_ratio)} % of their volume.${doubts.length ? " But " + doubts.join("; ") : ""}`
    : `No equilibrium was found (${found.status.replaceAll("_", " ")}): the picture shows where the search ended.`;
  byId("solid").setAttribute("aria-label", `Tongue in space, turned by ${Math.round(state.view[0])} degrees. Active: ${activated().join(", ") || "nothing"}. ${byId("found").textContent}`);
}
const activated = () => solid ? solid.body.muscles.flatMap((m, i) => state.activations[i] > 0 ? [`${m}=${Number(state.activations[i].toPrecision(12))}`] : []) : [];
function listenInSpace() {
  let held = null;
  const canvas = byId("solid");
  canvas.addEventListener("pointerdown", (e) => { held = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", (e) => {
    if (!held) return;
    turnTo(state.view[0] - 0.5 * (e.clientX - held[0]), state.view[1] + (e.pointerType === "touch" ? 0 : 0.5 * (e.clientY - held[1])));
    held = [e.clientX, e.clientY];
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { held = null; });
  for (const id of ["turn", "tilt"]) byId(id).addEventListener("input", () => turnTo(Number(byId("turn").value), Number(byId("tilt").value)));
  for (const button of byId("views").children) button.addEventListener("click", () => turnTo(...button.dataset.view.split(",").map(Number)));
  byId("cut").addEventListener("change", () => { state.cut = byId("cut").checked; paint(); remember(); });
  byId("solid-slack").addEventListener("click", () => { state.activations.fill(0); showSolidControls(); pullInSpace(); });
  if (hasOwnBody()) byId("body").querySelector("[value=space]").remove();
}
