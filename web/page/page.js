const errors = [];
window.addEventListener("error", (e) => errors.push(e.message));
window.addEventListener("unhandledrejection", (e) => errors.push(String(e.reason)));
const byId = (id) => document.getElementById(id);
const own = JSON.parse(byId("own").textContent);
const still = matchMedia("(prefers-reduced-motion: reduce)");
const round = (x, digits = 1) => Number(x).toFixed(digits).replace(/^-(0\.?0*)$/, "$1");
const element = (name, properties = {}, ...children) => {
  const node = Object.assign(document.createElement(name), properties);
  node.append(...children);
  return node;
};

// What is shown; the link holds all of it.
const state = { continuum: own.continuum ?? false, tensions: [], bones: [0, 0, 0], gravity: "", palate: false, mesh: true, subject: "", vowel: "", target: "ratio", along: null, lips: [8, 0] };
let body, live, worker, draw, path, sound, fit = null, shape = null, table = null, baseline = null;

// -- The library, here and in a worker ----------------------------------------------------------------------------------------------
async function unpacked() {
  const packed = Uint8Array.from(atob(byId("wasm").textContent), (c) => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// Long work is done beside the page where the browser lets it; else in it. A fit that nobody waits for any more is ended.
function makeWorker(module) {
  const source = `${makeEngine}\nlet engine; onmessage = ({ data }) => { if (data.module) engine = makeEngine(data.module); else postMessage(engine.ask(data)); };`;
  const waiting = [];
  let beside = null, opened = null, read = null;
  const here = (request) => new Promise((done) => setTimeout(() => done(live.ask(request)), 0));
  const post = (request) => new Promise((done) => { waiting.push({ done, request }); beside.postMessage(request); });
  const start = () => {
    try {
      beside = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
      beside.onmessage = ({ data }) => waiting.shift().done(data);
      beside.onerror = (e) => { e.preventDefault(); beside = null; waiting.splice(0).forEach((w) => w.done(live.ask(w.request))); };
      beside.postMessage({ module });
    } catch { beside = null; }
  };
  start();
  return (request) => {
    if (beside && ["open", "table", "fit"].includes(request.ask) && waiting.some((w) => w.request.ask === "fit")) {
      beside.terminate();
      waiting.splice(0).forEach((w) => w.done({ error: "", ended: true }));
      start();
      for (const again of [opened, read]) if (beside && again) post(again);
    }
    if (request.ask === "open") opened = request;
    if (request.ask === "table") read = request;
    return beside ? post(request) : here(request);
  };
}

const spacing = () => own[state.continuum ? "continuum_h_mm" : "springs_h_mm"] ?? 5.5;
function scene(bones = [0, 0, 0]) {
  const effects = own.finite_elements ? { finite_elements: true } : { incompressibility: true };
  if (own.straight_paths === false) effects.straight_paths = false;
  if (state.gravity) effects.gravity = { posture: state.gravity };
  if (state.palate) effects.contact = {};
  if (bones[0]) effects.jaw = { opening_deg: bones[0] };
  if (bones[1] || bones[2]) effects.hyoid = { shift_mm: [bones[1], bones[2]] };
  return { title: "tongue.html", want: "shape", body: { tongue: { h_mm: spacing() } }, material: own.material ?? {}, effects };
}
const words = (tensions = state.tensions) => body.muscles.map((m, i) => `${m.name}=${tensions[i]}`).filter((_, i) => tensions[i] !== 0);

// -- What is said -------------------------------------------------------------------------------------------------------------------
function complain(text) {
  byId("trouble").textContent = text ?? "";
  byId("trouble").hidden = !text;
}
function verdict(text, doubts = []) {
  byId("verdict").textContent = text;
  const list = element("ul", {}, ...doubts.map((d) => element("li", { textContent: d })));
  byId("doubts").replaceChildren(...doubts.length ? [element("details", {}, element("summary", { textContent: `${doubts.length} reason${doubts.length > 1 ? "s" : ""} for doubt` }), list)] : []);
}

// -- Frames -------------------------------------------------------------------------------------------------------------------------
let asked = false, idle = 0, checked = 0, tween = null;
const times = [], frames = [];
function move() {
  if (!asked) { asked = true; requestAnimationFrame(step); }
}
function step(now) {
  asked = false;
  if (tween) {
    const part = Math.min(1, (now - tween.start) / 450), s = part * part * (3 - 2 * part);
    state.tensions = tween.from.map((t, i) => t + s * (tween.to[i] - t));
    state.bones = tween.bones.map((b, i) => b + s * (tween.toBones[i] - b));
    if (part === 1) { state.tensions = tween.to.slice(); state.bones = tween.toBones.slice(); tween = null; }
    showControls();
  }
  const clock = performance.now();
  const next = live.frame([...state.bones, ...state.lips], state.tensions, body.nodes_m.length);
  times.push(performance.now() - clock);
  if (times.length > 60) times.shift();
  frames.push(now);
  while (frames.length > 60 || now - frames[0] > 1000) frames.shift();
  if (next.error) { complain(next.error); return; }
  shape = next;
  show();
  clearTimeout(idle);
  if (tween) move(); else idle = setTimeout(check, 180);
}

// When nothing moves: the same posture from rest, and whether it is on the branch that begins there.
let checking = false, again = false;
async function check() {
  remember();
  if (checking) { again = true; return; }
  checking = true;
  const [of, tensions] = [++checked, state.tensions.slice()];
  const found = await worker({ ask: "simulate", tensions: words(tensions), scene: scene(state.bones) });
  checking = false;
  if (again || of !== checked || tensions.some((t, i) => t !== state.tensions[i])) { again = false; if (!asked && !tween) check(); return; }
  if (found.ended) { check(); return; }
  if (found.error) { complain(found.error); return; }
  complain(null);
  const apart = Math.max(...found.positions_m.map((p, n) => Math.hypot(p[0] - shape.at[2 * n], p[1] - shape.at[2 * n + 1])));
  if (apart > 1e-7 && found.status === "converged") {
    live.ask({ ask: "place", positions_m: found.positions_m });
    shape = { ...shape, at: Float64Array.from(found.positions_m.flat()), lengths: Float64Array.from(body.muscles, (m) => found.lengths_mm[m.name] / 1e3) };
    show();
  }
  const doubts = found.alarms.map((a) => a.text);
  byId("found").textContent = found.status === "converged"
    ? `Equilibrium${found.connection === "traced" ? ", followed from rest" : ""}; triangles keep ${round(100 * found.min_area_ratio, 0)} to ${round(100 * found.max_area_ratio, 0)} % of their area.${doubts.length ? " But " + doubts.join("; ") : ""}`
    : `No equilibrium was found (${found.status.replaceAll("_", " ")}).`;
}

// -- Pictures of numbers ------------------------------------------------------------------------------------------------------------
const percent = (x) => 100 * (x - 1);
function simulated() {
  const mm = Array.from(shape.lengths, (l) => 1e3 * l);
  if (fit?.target_kind === "ratio") {
    const over = mm[body.muscles.findIndex((m) => m.name === fit.reference)] || 1;
    return mm.map((l) => l / over);
  }
  return mm.map((l, i) => l / (fit ? fit.model_baseline_lengths_mm[body.muscles[i].name] : 1e3 * body.muscles[i].rest_length_m));
}
function measured(name) {
  if (!fit) return undefined;
  return (fit.target_kind === "ratio" ? fit.target_ratios : fit.target_stretches)[name];
}
function show() {
  if (!shape) return;
  draw(shape.at, state.tensions, state.bones, state);
  if (body.tract) sound.hear(shape);
  const ratio = fit?.target_kind === "ratio", values = simulated();
  const scale = (x) => Math.max(0, Math.min(200, ratio ? x * 100 : 100 + 2.5 * percent(x)));
  body.muscles.forEach((m, i) => {
    const row = rows[i], [zero, at] = [ratio ? 0 : 100, scale(values[i])], seen = measured(m.name);
    const bar = (rect, to) => { rect.setAttribute("x", Math.min(zero, to)); rect.setAttribute("width", Math.abs(to - zero)); };
    bar(row.sim, at);
    row.mea.style.display = seen === undefined ? "none" : "";
    if (seen !== undefined) bar(row.mea, scale(seen));
    row.zero.setAttribute("x1", zero); row.zero.setAttribute("x2", zero);
    const said = (x) => ratio ? round(x, 3) : `${x >= 1 ? "+" : ""}${round(percent(x))} %`;
    row.name.textContent = `${m.name} ${said(values[i])}${seen === undefined ? "" : `, measured ${said(seen)}`}`;
  });
  byId("what").textContent = ratio ? `length over that of ${fit.reference}, 0 to 2` : fit ? `length against /${fit.baseline}/, −40 to +40 %` : "length against rest, −40 to +40 %";
  const ms = times.slice().sort((a, b) => a - b)[times.length >> 1] ?? 0;
  const rate = frames.length > 5 ? `, ${Math.round(1000 * (frames.length - 1) / (frames.at(-1) - frames[0]))} frames/s` : "";
  byId("speed").textContent = `solved in ${ms < 1 ? ms.toFixed(2) : ms.toFixed(1)} ms${rate}`;
  byId("mouth-text").textContent = `Front of the mouth to the left. Pulling: ${body.muscles.filter((_, i) => state.tensions[i] > 0.05).map((m) => m.full_name).join("; ") || "nothing"}.`;
}

// What the letters stand for: the portions of a muscle share its name, and their own stands behind a comma.
function explain() {
  const bases = new Map(), portions = new Map();
  for (const m of body.muscles) {
    const [base, portion] = m.full_name.split(", ");
    if (!portion) continue;
    bases.set(m.name.slice(0, -1), base);
    portions.set(m.name.slice(-1), portion);
  }
  const said = (map) => [...map].map(([short, long]) => `${short} ${long}`).join(", ");
  byId("names").textContent = bases.size ? `${said(bases)}; ${said(portions)}` : "";
}

const rows = [];
function makeRows() {
  rows.length = 0;
  byId("rows").replaceChildren(...body.muscles.map((m, i) => {
    const slider = element("input", { type: "range", min: 0, max: 100, step: 0.1, id: `pull-${i}` });
    const number = element("input", { type: "number", min: 0, max: 1000, step: 0.1, id: `n-${i}` });
    slider.setAttribute("aria-label", `Tension of ${m.name}, ${m.full_name}`);
    number.setAttribute("aria-label", `Tension of ${m.name} as a number`);
    const mark = make("svg", { viewBox: "0 0 14 14", "aria-hidden": "true" }, make("rect", { x: 1, y: 1, width: 12, height: 12, rx: 2, fill: m.colour, stroke: "currentColor" }));
    const name = make("title"), sim = make("rect", { y: 3, height: 10, fill: m.colour }), mea = make("rect", { class: "mea", y: 15, height: 9 }), zero = make("line", { y1: 0, y2: 28 });
    const bars = make("svg", { class: "bars", role: "img", viewBox: "0 0 200 28", preserveAspectRatio: "none" }, name, sim, mea, zero);
    if (m.colour === "#000000") sim.setAttribute("fill", "light-dark(#000, #999)"), sim.style.fill = "light-dark(#000, #999)";
    rows.push({ slider, number, sim, mea, zero, name });
    slider.addEventListener("input", () => pull(i, Number(slider.value)));
    number.addEventListener("change", () => typed(i, number.value));
    const label = element("label", { htmlFor: slider.id, title: m.full_name }, mark, m.name);
    return element("div", { className: "row" }, label, slider, number, bars);
  }));
}
function pull(i, newtons) {
  tween = null;
  state.tensions[i] = newtons;
  state.along = null;
  showControls();
  move();
}
// A number is read by the program, which says what is wrong with it.
async function typed(i, text) {
  const said = await worker({ ask: "tensions", tensions: [`${body.muscles[i].name}=${text}`] });
  complain(said.error);
  if (said.error) showControls(); else pull(i, said.tensions_n[i]);
}
function showControls() {
  body.muscles.forEach((_, i) => {
    rows[i].slider.value = state.tensions[i];
    if (document.activeElement !== rows[i].number || tween) rows[i].number.value = round(state.tensions[i]);
  });
  ["jaw", "back", "up"].forEach((id, i) => {
    byId(id).value = state.bones[i];
    byId(`${id}-out`).textContent = `${round(state.bones[i])} ${i === 0 ? "°" : "mm"}`;
  });
  ["lips", "round"].forEach((id, i) => {
    byId(id).value = state.lips[i];
    byId(`${id}-out`).textContent = `${round(state.lips[i])} mm`;
  });
  byId("as-spoken").disabled = !body.tract?.posture?.[state.vowel];
  byId("body").value = state.continuum ? "continuum" : "springs";
  byId("gravity").value = state.gravity;
  byId("palate").checked = state.palate;
  byId("mesh").checked = state.mesh;
  document.querySelector(`[name="target"][value="${state.target}"]`).checked = true;
  for (const b of byId("vowel").querySelectorAll("button")) b.setAttribute("aria-pressed", b.dataset.vowel === state.vowel);
  showAlong();
}
function glide(to, toBones) {
  if (still.matches || !shape) {
    tween = null;
    [state.tensions, state.bones] = [to.slice(), toBones.slice()];
    showControls();
  } else tween = { start: performance.now(), from: state.tensions.slice(), to, bones: state.bones.slice(), toBones };
  move();
}

// -- Vowels and valleys -------------------------------------------------------------------------------------------------------------
function makeVowels() {
  const subjects = [...new Set([...table.fits, ...table.baselines].map((f) => f.subject))];
  byId("subject").replaceChildren(...subjects.map((s) => element("option", { value: s, textContent: s })));
  if (!subjects.includes(state.subject)) state.subject = subjects.includes("S2") ? "S2" : subjects[0] ?? "";
  byId("subject").value = state.subject;
  const of = (list) => list.filter((f) => f.subject === state.subject).map((f) => f.vowel);
  const bases = of(table.baselines), vowels = [...new Set([...of(table.fits), ...bases])];
  byId("vowel").replaceChildren(...vowels.map((v) => {
    const button = element("button", { type: "button", textContent: v, title: bases.includes(v) ? "the baseline" : `fit /${v}/` });
    button.dataset.vowel = v;
    button.setAttribute("aria-label", `vowel ${v}${bases.includes(v) ? ", the baseline" : ""}`);
    button.addEventListener("click", () => choose(v));
    return button;
  }));
  byId("origin").textContent = `${table.origin}: ${subjects.length} speaker${subjects.length === 1 ? "" : "s"}, ${new Set(table.fits.map((f) => `${f.subject} ${f.vowel}`)).size} vowels to fit.`
    + (table.told.length ? ` ${table.told.join(" ")}` : "");
}
let fitting = 0;
async function choose(vowel, keep = false) {
  state.vowel = vowel;
  state.along = null;
  const mine = ++fitting, { subject, target } = state;
  showControls();
  const row = table.fits.find((f) => f.subject === subject && f.vowel === vowel && f.target === target);
  const base = table.baselines.some((b) => b.subject === subject && b.vowel === vowel);
  if (base) {
    fit = null;
    byId("valley").hidden = true;
    verdict(`/${vowel}/ is ${subject}’s baseline: every other vowel is compared with it. ${target === "ratio" ? "Ratios take it for the shape at rest." : "Stretches take it for a posture with 8 N/m in every muscle."}`);
    if (!keep) plain(body.muscles.map(() => target === "ratio" || own.thesis ? 0 : 8), [0, 0, 0]);
    return;
  }
  verdict(`Fitting ${subject} /${vowel}/ …`);
  const clock = performance.now();
  const ready = !state.continuum === !own.continuum && own.fits?.find((f) => f.subject === subject && f.vowel === vowel && f.target_kind === target && table.own);
  const found = ready || await worker({ ask: "fit", subject, vowel, baseline: row?.baseline ?? null, target });
  if (mine !== fitting) return;
  if (found.error) {
    fit = null;
    byId("valley").hidden = true;
    verdict(found.error);
    show();
    return;
  }
  fit = found;
  const took = ready ? "as the file has it" : `${fit.evaluations} equilibria in ${round((performance.now() - clock) / 1000, 2)} s`;
  const count = fit.identifiability?.undetermined ?? 0;
  verdict(`${subject} /${vowel}/ against /${fit.baseline}/: ${fit.status.replaceAll("_", " ")}, missed by ${fit.misfit.toExponential(1)}; ${took}.${count ? ` Not unique: ${count} direction${count > 1 ? "s are" : " is"} open.` : ""}`, fit.alarms.map((a) => a.text));
  byId("valley").hidden = !fit.valley;
  if (fit.valley) drawPath();
  if (keep) { showControls(); show(); } else plain(body.muscles.map((m) => fit.tensions_n[m.name] ?? 0), [0, ...(fit.hyoid_mm ?? [0, 0])]);
}
// What a fit is made with: no weight, no palate, the jaw closed.
function plain(tensions, bones) {
  if (state.gravity || state.palate) {
    [state.gravity, state.palate] = ["", false];
    act();
  }
  if (fit?.valley) state.along = fit.valley.answer;
  glide(tensions, bones);
  showControls();
}
function drawPath() {
  const { points, answer, ends } = fit.valley, names = fit.active, svg = byId("path");
  const wide = Math.max(280, svg.parentNode.clientWidth), right = wide - 44;
  svg.setAttribute("viewBox", `0 0 ${wide} 110`);
  byId("along").max = points.length - 1;
  byId("from").textContent = `← ${ends[0]}`;
  byId("to").textContent = `${ends[1]} →`;
  const top = Math.max(...points.flatMap((p) => names.map((m) => p.tensions_n[m]))) || 1;
  const x = (i) => 34 + (right - 34) * i / (points.length - 1), y = (t) => 94 - 86 * t / top;
  const text = (at, anchor, said) => make("text", { x: at[0], y: at[1], "text-anchor": anchor }, said);
  // Names at the ends of their curves, from the top down, none on another.
  const last = names.map((m) => ({ m, at: y(points.at(-1).tensions_n[m]) })).sort((a, b) => a.at - b.at);
  last.forEach((l, i) => { l.at = Math.max(l.at, i ? last[i - 1].at + 11 : 8); });
  last.reverse().forEach((l, i) => { l.at = Math.min(l.at, i ? last[i - 1].at - 11 : 94); });
  const curves = names.flatMap((m) => {
    const colour = body.muscles.find((k) => k.name === m)?.colour ?? "currentColor";
    const d = "M" + points.map((p, i) => `${x(i).toFixed(1)} ${y(p.tensions_n[m]).toFixed(1)}`).join("L");
    const edge = make("path", { d, stroke: "currentColor" });
    edge.style.strokeWidth = 3.6;
    return [edge, make("path", { d, stroke: colour }), text([right + 5, last.find((l) => l.m === m).at + 4], "start", m)];
  });
  path = { x };
  svg.replaceChildren(make("path", { class: "axis", d: `M34 4V94H${right}` }), text([30, 14], "end", round(top, 0)), text([30, 97], "end", "0"), text([30, 56], "end", "N/m"),
    ...curves, make("line", { x1: x(answer), x2: x(answer), y1: 94, y2: 99, stroke: "currentColor", "stroke-width": 2 }), text([x(answer), 109], "middle", "answer"), make("line", { class: "here", y1: 2, y2: 96 }));
  showAlong();
}
function showAlong() {
  if (byId("valley").hidden || !fit?.valley) return;
  const here = byId("path").querySelector(".here");
  here.style.display = state.along === null ? "none" : "";
  if (state.along === null) return;
  byId("along").value = state.along;
  const x = path.x(state.along);
  here.setAttribute("x1", x); here.setAttribute("x2", x);
}
function slide(along) {
  const { points } = fit.valley, i = Math.min(Math.floor(along), points.length - 2), part = along - i;
  tween = null;
  state.along = along;
  body.muscles.forEach((m, n) => {
    const at = (p) => p.tensions_n[m.name] ?? (fit.tensions_n[m.name] ?? 0);
    state.tensions[n] = (1 - part) * at(points[i]) + part * at(points[i + 1]);
  });
  showControls();
  move();
}

// -- Body, weight, palate -----------------------------------------------------------------------------------------------------------
function act() {
  const request = { ask: "act", scene: scene() };
  const said = live.ask(request);
  if (said.error) {
    complain(said.error);
    [state.gravity, state.palate] = ["", false];
    live.ask({ ask: "act", scene: scene() });
    showControls();
  }
  move();
}
function open() {
  const request = { ask: "open", body: { ...(own.body ?? {}), h_mm: spacing(), continuum: state.continuum }, thesis: own.thesis ?? false, scene: scene() };
  const made = live.ask(request);
  if (made.error) { complain(made.error); return false; }
  worker(request);
  body = made;
  shape = null;
  if (state.tensions.length !== body.muscles.length) state.tensions = body.muscles.map(() => 0);
  draw = makeMouth(byId("mouth"), body);
  byId("sound").hidden = !body.tract;
  makeRows();
  explain();
  return true;
}
async function readTable(text, file) {
  const request = { ask: "table", text, file };
  const said = live.ask(request);
  if (said.error) { complain(said.error); return false; }
  await worker(request);
  complain(null);
  table = { ...said, own: text === (own.table?.text ?? null) };
  fit = null;
  byId("valley").hidden = true;
  makeVowels();
  return true;
}

// -- The link -----------------------------------------------------------------------------------------------------------------------
function link() {
  const q = new URLSearchParams();
  if (state.continuum !== (own.continuum ?? false)) q.set("body", state.continuum ? "continuum" : "springs");
  if (state.subject) q.set("s", state.subject);
  if (state.vowel) q.set("v", state.vowel);
  if (state.vowel) q.set("k", state.target);
  const pulled = words(state.tensions.map((t) => Number(t.toPrecision(12))));
  if (pulled.length) q.set("t", pulled.join(","));
  if (state.bones.some((b) => b !== 0)) q.set("bones", state.bones.map((b) => Number(b.toPrecision(12))).join(","));
  if (state.gravity) q.set("gravity", state.gravity);
  if (state.palate) q.set("palate", "1");
  if (state.lips[0] !== 8 || state.lips[1] !== 0) q.set("lips", state.lips.join(","));
  if (!state.mesh) q.set("mesh", "0");
  if (state.along !== null) q.set("along", state.along);
  return "#" + q.toString().replaceAll("%2C", ",").replaceAll("%3D", "=");
}
function remember() {
  if (!testing) try { history.replaceState(null, "", link()); } catch { /* a page without an address has no link */ }
}
// Takes up what a link says; the program says what is wrong with it.
async function takeUp(fragment) {
  const q = new URLSearchParams(fragment.replace(/^#/, ""));
  const kind = q.get("body");
  if (kind && (kind === "continuum") !== state.continuum) {
    state.continuum = kind === "continuum";
    if (!open()) return;
    await readTable(own.table?.text ?? null, own.table?.file ?? "");
  }
  state.subject = q.get("s") ?? state.subject;
  state.target = q.get("k") === "stretch" ? "stretch" : "ratio";
  state.gravity = ["upright", "supine", "prone"].includes(q.get("gravity")) ? q.get("gravity") : "";
  state.palate = q.get("palate") === "1";
  state.mesh = q.get("mesh") !== "0";
  makeVowels();
  const given = q.get("t")?.split(",").filter((w) => w !== "") ?? [];
  const read = live.ask({ ask: "tensions", tensions: given });
  const bones = (q.get("bones") ?? "0,0,0").split(",").map(Number);
  state.bones = [0, 1, 2].map((i) => Number.isFinite(bones[i]) ? bones[i] : 0);
  const lips = (q.get("lips") ?? "8,0").split(",").map(Number);
  state.lips = [lips[0] > 0 ? Math.min(lips[0], 20) : 8, lips[1] > 0 ? Math.min(lips[1], 8) : 0];
  state.tensions = read.error ? body.muscles.map(() => 0) : read.tensions_n;
  if (state.gravity || state.palate) act();
  showControls();
  move();
  if (q.get("v")) {
    await choose(q.get("v"), q.has("t"));
    const along = Number(q.get("along") ?? NaN);
    if (fit?.valley && along >= 0 && along <= fit.valley.points.length - 1) { state.along = along; showControls(); }
  }
  if (read.error) complain(read.error);
}

// -- Files --------------------------------------------------------------------------------------------------------------------------
const made = () => `tongue-fit ${body.version}, tongue.html${link()}`;
const fileName = (ending) => `tongue${state.vowel ? `-${state.subject}-${state.vowel}` : ""}.${ending}`.replace(/[^\p{L}\p{N}.-]+/gu, "-");
function save(blob, name) {
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
async function png() {
  const picture = new Image();
  picture.src = `data:image/svg+xml,${encodeURIComponent(pictureText(byId("mouth"), made()))}`;
  await picture.decode();
  const canvas = element("canvas", { width: 2 * picture.naturalWidth, height: 2 * picture.naturalHeight });
  canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

// -- All together -------------------------------------------------------------------------------------------------------------------
function listen() {
  byId("subject").addEventListener("change", () => { state.subject = byId("subject").value; makeVowels(); if (state.vowel) choose(state.vowel); });
  for (const radio of document.querySelectorAll("[name=target]")) radio.addEventListener("change", () => { state.target = radio.value; if (state.vowel) choose(state.vowel); });
  byId("along").addEventListener("input", () => slide(Number(byId("along").value)));
  byId("slack").addEventListener("click", () => { [state.vowel, state.along, fit] = ["", null, null]; fitting++; byId("valley").hidden = true; verdict(""); glide(body.muscles.map(() => 0), [0, 0, 0]); showControls(); });
  ["jaw", "back", "up"].forEach((id, i) => byId(id).addEventListener("input", () => { tween = null; state.bones[i] = Number(byId(id).value); showControls(); move(); }));
  ["lips", "round"].forEach((id, i) => byId(id).addEventListener("input", () => { state.lips[i] = Number(byId(id).value); showControls(); move(); }));
  byId("as-spoken").addEventListener("click", () => {
    const spoken = body.tract.posture[state.vowel];
    state.lips = [spoken.lip_opening_mm, spoken.lip_protrusion_mm];
    glide(state.tensions.slice(), [spoken.jaw_deg, state.bones[1], state.bones[2]]);
    showControls();
  });
  byId("play").addEventListener("click", () => sound.toggle());
  byId("volume").addEventListener("input", () => sound.level());
  window.addEventListener("keydown", (e) => {
    const typing = e.target.closest?.("select, textarea, input:not([type=range]):not([type=checkbox]):not([type=radio])");
    if (e.key === "p" && !typing && !e.ctrlKey && !e.metaKey && !e.altKey && !e.repeat && body.tract) { e.preventDefault(); sound.toggle(); }
  });
  byId("body").addEventListener("change", () => {
    state.continuum = byId("body").value === "continuum";
    verdict("");
    if (open()) { act(); showControls(); if (state.vowel) choose(state.vowel); }
  });
  byId("gravity").addEventListener("change", () => { state.gravity = byId("gravity").value; act(); });
  byId("palate").addEventListener("change", () => { state.palate = byId("palate").checked; act(); });
  byId("mesh").addEventListener("change", () => { state.mesh = byId("mesh").checked; show(); remember(); });
  byId("table").addEventListener("change", async () => {
    const file = byId("table").files[0];
    if (file && await readTable(await file.text(), file.name)) { [state.vowel, state.along] = ["", null]; verdict("Choose a vowel."); showControls(); show(); }
  });
  byId("save-svg").addEventListener("click", () => save(new Blob([pictureText(byId("mouth"), made())], { type: "image/svg+xml" }), fileName("svg")));
  byId("save-png").addEventListener("click", async () => save(await png(), fileName("png")));
  byId("copy-link").addEventListener("click", async () => {
    const address = location.href.split("#")[0] + link();
    remember();
    try { await navigator.clipboard.writeText(address); byId("found").textContent = "The link is copied: it holds all that is set here."; }
    catch { byId("found").textContent = "The link is in the address bar: it holds all that is set here."; }
  });
  byId("theme").addEventListener("click", () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  });
  window.addEventListener("resize", () => { if (fit?.valley) drawPath(); });
  window.addEventListener("hashchange", () => takeUp(location.hash));
}
const testing = location.hash === "#self-test";
async function begin() {
  const module = await WebAssembly.compile(await unpacked());
  live = makeEngine(module);
  worker = makeWorker(module);
  if (!open() || !await readTable(own.table?.text ?? null, own.table?.file ?? "")) return;
  sound = makeSound(body.means);
  byId("made").textContent = `tongue-fit ${body.version}${own.command ? ` · ${own.command}` : ""} · ${body.what}`;
  if (body.palate_m === null) byId("palate").closest("label").hidden = true;
  if (!body.bones.some((b) => b.name === "hyoid") || !body.bones.some((b) => b.name === "mental_spine")) document.querySelector(".bones").hidden = true;
  listen();
  showControls();
  move();
  const first = table.fits.find((f) => f.subject === state.subject && f.vowel === "a") ?? table.fits[0];
  if (location.hash.length > 1 && !testing) await takeUp(location.hash);
  else if (first) { state.subject = first.subject; makeVowels(); await choose(first.vowel); }
  document.body.dataset.ready = "yes";
}
begin().catch((error) => { errors.push(String(error)); complain(`This page cannot run here: ${error}. It needs a browser of 2023 or newer.`); });
