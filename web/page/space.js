// The tongue in space, turned by hand: the faces of its surface are painted from the farthest to the nearest. Millimetres, x to the back,
// y to the right, z up.
const SOLID_NAMES = { GGP: "genioglossus, posterior", GGM: "genioglossus, middle", GGA: "genioglossus, anterior", STY: "styloglossus", GH: "geniohyoid", MH: "mylohyoid", HG: "hyoglossus", VERT: "verticalis", TRANS: "transversus", IL: "inferior longitudinal", SL: "superior longitudinal" };
// Colours of the muscles as in the program's pictures (Tol 2021), and of tissue without an active muscle.
const SOLID_COLOURS = [[204, 102, 119], [51, 34, 136], [221, 204, 119], [17, 119, 51], [136, 204, 238], [136, 34, 85], [68, 170, 153], [153, 153, 51], [170, 68, 153], [119, 170, 221], [238, 136, 102]];
const SOLID_TISSUE = [214, 205, 205], SOLID_ACTIVE = 5e-3, SOLID_ROOM = [56, 50];
const rgb = (colour, light) => `rgb(${colour.map((c) => Math.round(c * (0.58 + 0.42 * Math.max(0, light)))).join(" ")})`;

function makeSolid(canvas, body) {
  const context = canvas.getContext("2d");
  const shown = [...new Set(body.faces.concat(body.cut_faces).flatMap((f) => f.nodes))];
  const rest = body.rest_um, range = (i) => shown.reduce(([low, high], n) => [Math.min(low, rest[3 * n + i]), Math.max(high, rest[3 * n + i])], [Infinity, -Infinity]);
  const centre = [0, 1, 2].map((i) => { const [low, high] = range(i); return (low + high) / 2; });
  // The shape, and the shape at rest as it is seen, and from where.
  let at = rest, ghost = {};
  // Light from above and from the viewer's left, in the axes of the picture.
  const [LEFT, ABOVE, NEAR] = [-0.45, -0.45, 0.77];
  // The faces that are turned to the viewer, the farthest first, with their colours. Turned by 0 the speaker's left side is seen, by 90
  // degrees the front. In the picture x is to the right, y downwards, and the depth towards the viewer.
  function list(um, [turn, tilt], cut, activations) {
    const [sa, ca, sb, cb] = [turn, tilt].flatMap((d) => [Math.sin(d * Math.PI / 180), Math.cos(d * Math.PI / 180)]);
    const seen = [];
    for (const n of shown) {
      const [x, y, z] = [(um[3 * n] - centre[0]) / 1e3, (um[3 * n + 1] - centre[1]) / 1e3, (um[3 * n + 2] - centre[2]) / 1e3];
      const away = sa * x + ca * y;
      seen[n] = [ca * x - sa * y, -(sb * away + cb * z), sb * z - cb * away];
    }
    const found = [];
    for (const { nodes, muscles } of cut ? body.cut_faces : body.faces) {
      const a = seen[nodes[0]], b = seen[nodes[1]], c = seen[nodes[2]], d = seen[nodes[3]];
      const [ux, uy, uz, vx, vy, vz] = [c[0] - a[0], c[1] - a[1], c[2] - a[2], d[0] - b[0], d[1] - b[1], d[2] - b[2]];
      // Counter-clockwise as seen from outside; y is downwards here.
      const normal = [vy * uz - uy * vz, vz * ux - uz * vx, vx * uy - ux * vy];
      if (normal[2] <= 0) continue;
      let most = -1;
      for (const m of muscles) if (activations[m] > (activations[most] ?? SOLID_ACTIVE)) most = m;
      const light = (LEFT * normal[0] + ABOVE * normal[1] + NEAR * normal[2]) / (Math.hypot(...normal) || 1);
      found.push({ corners: [a, b, c, d], depth: a[2] + b[2] + c[2] + d[2], fill: rgb(SOLID_COLOURS[most] ?? SOLID_TISSUE, light) });
    }
    return found.sort((a, b) => a.depth - b.depth);
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
      context.lineJoin = "round";
      context.lineWidth = 1 / scale;
      const trace = ([a, b, c, d]) => { context.moveTo(a[0], a[1]); context.lineTo(b[0], b[1]); context.lineTo(c[0], c[1]); context.lineTo(d[0], d[1]); context.closePath(); };
      const key = `${view} ${cut}`;
      if (ghost.key !== key) ghost = { key, faces: list(rest, view, cut, []) };
      context.fillStyle = "rgb(128 128 128 / .2)";
      context.beginPath();
      for (const face of ghost.faces) trace(face.corners);
      context.fill();
      context.strokeStyle = "#4a4a4a";
      for (const face of list(at, view, cut, activations)) {
        context.beginPath();
        trace(face.corners);
        context.fillStyle = face.fill;
        context.fill();
        context.stroke();
      }
    },
    // The same as an element of SVG.
    picture({ view, cut, activations }) {
      const [wide, high] = SOLID_ROOM;
      const faces = list(at, view, cut, activations).map((f) => make("path", { d: `M${f.corners.map((p) => `${p[0].toFixed(2)} ${p[1].toFixed(2)}`).join("L")}Z`, fill: f.fill, stroke: "#4a4a4a", "stroke-width": 0.25, "stroke-linejoin": "round" }));
      return make("svg", { viewBox: `${-wide} ${-high} ${2 * wide} ${2 * high}` }, make("title", {}, "A tongue in space"), make("desc", {}, "Surface"), ...faces);
    },
  };
}

// -- Sliders, words and solves -------------------------------------------------------------------------------------------------------
// Number of Newton iterations of a picture while activations change, and of pictures without an equilibrium after which the whole search
// from rest is made.
const FEW = 2, PATIENT = 40;
let pulling = false, resting = false, pulled = 0, repaint = false;
const solidRows = [], paints = [];
// The user's own body has no form in space.
const hasOwnBody = () => Boolean(own.body?.anatomy ?? own.body?.mesh);
async function enterSpace() {
  if (!solid) {
    const made = await worker({ ask: "open_space" });
    if (made.ended) return enterSpace();
    complain("space", made.error);
    if (made.error) return false;
    solid = makeSolid(byId("solid"), made);
    byId("solid").setAttribute("aria-label", "Tongue in space");
    state.activations = made.muscles.map((_, i) => state.activations[i] ?? 0);
    makeSolidRows();
  }
  state.space = true;
  // The voice is of the tongue in the plane, and so are its controls.
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
// Goes on towards the equilibrium of the present activations, a few iterations for each picture.
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
      byId("found").textContent = next.status === "converged" ? "" : `On the way: forces of up to ${next.residual_n.toPrecision(1)} N are left.`;
    }
    if (pulled !== of) [of, tries] = [pulled, 0];
    else if (next.status === "converged") break;
  }
  pulling = false;
  complain("space", next?.error);
  if (!next?.error && state.space) rest(pulled); else resting = false;
}
// When nothing moves: the same activations from rest, as the program has them.
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
    : `No equilibrium was found (${found.status.replaceAll("_", " ")}): what is drawn is where the search ended.`;
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
