const errors = [];
window.addEventListener("error", (e) => errors.push(e.message));
window.addEventListener("unhandledrejection", (e) => errors.push(String(e.reason)));
const byId = (id) => document.getElementById(id);
const own = JSON.parse(byId("own").textContent);
const still = matchMedia("(prefers-reduced-motion: reduce)");
const way = (x, names) => `${round(Math.abs(x))} mm ${names[x < 0 ? 0 : 1]}`;
// Rounded towards one half, as in reports, so that a probability does not seem to reach a limit that it stays below.
const probability = (p) => ((p < 0.5 ? Math.ceil(100 * p - 1e-9) : Math.floor(100 * p + 1e-9)) / 100).toFixed(2);
const round = (x, digits = 1) => Number(x).toFixed(digits).replace(/^-(0\.?0*)$/, "$1");
const element = (name, properties = {}, ...children) => {
  const node = Object.assign(document.createElement(name), properties);
  node.append(...children);
  return node;
};

// The state that is shown; the link contains all of it.
const state = { continuum: own.continuum ?? false, tensions: [], bones: [0, 0, 0], gravity: "", palate: false, mesh: true, subject: "", vowel: "", baseline: "", target: "stretch", along: null, spoken: true, lips: [8, 0], space: false, activations: [], view: [40, 15], cut: false };
let body, live, solid = null, worker, thinkers, draw, path, sound, fit = null, rises = null, shape = null, table = null;
// The link as it was opened; the link follows the state only after the opened one has been used.
const opening = location.hash;
let ready = false;

// -- The library, here and in a worker ----------------------------------------------------------------------------------------------
async function unpacked() {
  const packed = Uint8Array.from(atob(byId("wasm").textContent), (c) => c.charCodeAt(0));
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// Long work runs in a worker if the browser allows it, and otherwise in the page, except for verdicts, which would stop the sliders for
// seconds. A fit or a verdict that is no longer wanted is ended.
const LONG = ["fit", "draws", "verdict"];
function makeWorker(module) {
  const source = `${makeEngine}\nlet engine; onmessage = ({ data }) => { if (data.module) engine = makeEngine(data.module); else postMessage(engine.ask(data)); };`;
  const waiting = [];
  let beside = null, opened = null, read = null;
  const answer = (request) => request.ask === "draws" ? { error: "this browser does no work beside a page" } : live.ask(request);
  const here = (request) => new Promise((done) => setTimeout(() => done(answer(request)), 0));
  const post = (request) => new Promise((done) => { waiting.push({ done, request }); beside.postMessage(request); });
  const start = () => {
    try {
      beside = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
      beside.onmessage = ({ data }) => waiting.shift().done(data);
      beside.onerror = (e) => { e.preventDefault(); beside = null; waiting.splice(0).forEach((w) => w.done(answer(w.request))); };
      beside.postMessage({ module });
    } catch { beside = null; }
  };
  start();
  return (request) => {
    if (beside && ["open", "table", ...LONG].includes(request.ask) && waiting.some((w) => LONG.includes(w.request.ask))) {
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
const walled = () => state.palate && body?.palate_m != null;
function scene(bones = [0, 0, 0], walls = walled()) {
  const effects = { incompressibility: true };
  if (state.gravity) effects.gravity = { posture: state.gravity };
  if (walls) effects.contact = {};
  if (bones[0]) effects.jaw = { opening_deg: bones[0] };
  if (bones[1] || bones[2]) effects.hyoid = { shift_mm: [bones[1], bones[2]] };
  return { title: "tongue.html", want: "shape", body: { tongue: { h_mm: spacing() } }, material: own.material ?? {}, effects };
}
const words = (tensions = state.tensions) => body.muscles.map((m, i) => `${m.name}=${tensions[i]}`).filter((_, i) => tensions[i] !== 0);

// -- Messages -----------------------------------------------------------------------------------------------------------------------
// A message about each kind of trouble stays until the trouble is over; one about a link stays until it is closed or another link is opened.
const troubles = new Map();
function complain(kind, text) {
  if (text) troubles.set(kind, text); else if (!troubles.delete(kind)) return;
  byId("trouble").hidden = !troubles.size;
  byId("trouble").replaceChildren(...[...troubles].map(([of, said]) => {
    const close = element("button", { type: "button", textContent: "Close" });
    close.addEventListener("click", () => complain(of, null));
    return element("p", {}, said, " ", ...of === "link" ? [close] : []);
  }));
}
function verdict(text, doubts = []) {
  byId("verdict").textContent = text;
  const list = element("ul", {}, ...doubts.map((d) => element("li", { textContent: d })));
  byId("doubts").replaceChildren(...doubts.length ? [element("details", {}, element("summary", { textContent: `${doubts.length} reason${doubts.length > 1 ? "s" : ""} for doubt` }), list)] : []);
}

// -- Frames -------------------------------------------------------------------------------------------------------------------------
let asked = false, idle = 0, checked = 0, told = 0, tween = null;
const times = [], frames = [];
function move() {
  if (!asked) { asked = true; requestAnimationFrame(step); }
}
// The shape at the present tensions, solved from the last one.
const solved = () => live.frame([...state.bones, ...state.lips], state.tensions, body.nodes_m.length);
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
  const next = solved();
  times.push(performance.now() - clock);
  if (times.length > 60) times.shift();
  frames.push(now);
  while (frames.length > 60 || now - frames[0] > 1000) frames.shift();
  if (next.error) { complain("frame", next.error); return; }
  shape = next;
  show(now - told > 100);
  clearTimeout(idle);
  idle = 0;
  if (tween) move(); else idle = setTimeout(() => { idle = 0; tell(); check(); }, 180);
}

// When nothing moves, the same posture is solved from rest, and it is checked whether it is on the branch that begins there.
let checking = false, again = false;
const settled = () => !asked && !idle && !checking && !pulling && !resting;
async function check() {
  remember();
  if (checking) { again = true; return; }
  checking = true;
  const [of, tensions] = [++checked, state.tensions.slice()];
  const found = await worker({ ask: "simulate", tensions: words(tensions), scene: scene(state.bones) });
  checking = false;
  if (again || of !== checked || tensions.some((t, i) => t !== state.tensions[i])) { again = false; if (!asked && !tween && !idle) check(); return; }
  if (found.ended) { check(); return; }
  complain("frame", found.error);
  if (found.error) return;
  const apart = Math.max(...found.positions_m.map((p, n) => Math.hypot(p[0] - shape.at[2 * n], p[1] - shape.at[2 * n + 1])));
  if (apart > 1e-7 && found.status === "converged") {
    live.ask({ ask: "place", positions_m: found.positions_m });
    // Solved again from there, since formants and the depth beyond the palate belong to the shape too.
    const next = solved();
    complain("frame", next.error);
    if (next.error) return;
    shape = next;
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
  return mm.map((l, i) => l / (1e3 * body.muscles[i].rest_length_m));
}
function measured(name) {
  if (!fit) return undefined;
  return (fit.target_kind === "ratio" ? fit.target_ratios : fit.target_stretches)[name];
}
function show(inWords = true) {
  if (!shape) return;
  draw(shape.at, state.tensions, state.bones, state);
  if (body.tract) sound.hear(shape);
  const ratio = fit?.target_kind === "ratio", values = simulated();
  const scale = (x) => Math.max(0, Math.min(200, ratio ? x * 100 : 100 + 2.5 * percent(x)));
  body.muscles.forEach((m, i) => {
    const row = rows[i], [zero, at] = [ratio ? 0 : 100, scale(values[i])], seen = measured(m.name);
    const bar = (rect, to) => { set(rect, "x", Math.min(zero, to)); set(rect, "width", Math.abs(to - zero)); };
    bar(row.sim, at);
    set(row.mea, "display", seen === undefined ? "none" : "inline");
    if (seen !== undefined) bar(row.mea, scale(seen));
    set(row.zero, "x1", zero); set(row.zero, "x2", zero);
  });
  if (inWords) tell();
}
// The text about a shape; while it moves, ten times a second, because a browser computes the layout again for each text.
function tell() {
  told = performance.now();
  showChanged();
  if (!shape) return;
  if (body.tract) sound.tell();
  const ratio = fit?.target_kind === "ratio", values = simulated();
  const said = (x) => ratio ? round(x, 3) : `${x >= 1 ? "+" : ""}${round(percent(x))} %`;
  body.muscles.forEach((m, i) => {
    const seen = measured(m.name);
    rows[i].name.textContent = `${m.name} ${said(values[i])}${seen === undefined ? "" : `, measured ${said(seen)}`}`;
  });
  byId("what").textContent = ratio ? `length over that of ${fit.reference}, 0 to 2` : fit ? `length against /${fit.baseline}/, −40 to +40 %` : "length against rest, −40 to +40 %";
  const ms = times.slice().sort((a, b) => a - b)[times.length >> 1] ?? 0;
  const rate = frames.length > 5 ? `, ${Math.round(1000 * (frames.length - 1) / (frames.at(-1) - frames[0]))} frames/s` : "";
  const beyond = 1e3 * shape.beyond;
  byId("beyond").hidden = !(beyond >= 0.05);
  if (beyond >= 0.05) byId("beyond").textContent = `This shape goes ${round(beyond)} mm through palate or teeth, which are set not to stop it.`;
  byId("speed").textContent = `solved in ${ms < 1 ? ms.toFixed(2) : ms.toFixed(1)} ms${rate}`;
  byId("mouth-text").textContent = `Front of the mouth to the left. Pulling: ${body.muscles.filter((_, i) => state.tensions[i] > 0.05).map((m) => m.full_name).join("; ") || "nothing"}.`;
}

// The full names of the muscles: the portions of a muscle share its name, and the name of a portion follows a comma.
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
    const number = element("input", { type: "text", inputMode: "decimal", autocomplete: "off", id: `n-${i}` });
    slider.setAttribute("aria-label", `Tension of ${m.name}, ${m.full_name}`);
    number.setAttribute("aria-label", `Tension of ${m.name} as a number`);
    const mark = make("svg", { viewBox: "0 0 14 14", "aria-hidden": "true" }, make("rect", { x: 1, y: 1, width: 12, height: 12, rx: 2, fill: m.colour, stroke: "currentColor" }));
    const name = make("title"), sim = make("rect", { y: 3, height: 10, fill: m.colour }), mea = make("rect", { class: "mea", y: 15, height: 9 }), zero = make("line", { y1: 0, y2: 28 });
    const bars = make("svg", { class: "bars", role: "img", viewBox: "0 0 200 28", preserveAspectRatio: "none" }, name, sim, mea, zero);
    if (m.colour === "#000000") sim.setAttribute("fill", "light-dark(#000, #999)"), sim.style.fill = "light-dark(#000, #999)";
    const rise = element("span", { className: "rise" });
    rows.push({ slider, number, rise, sim, mea, zero, name });
    slider.addEventListener("input", () => pull(i, Number(slider.value)));
    number.addEventListener("change", () => typed(i, number.value));
    const label = element("label", { htmlFor: slider.id, title: m.full_name }, mark, m.name);
    return element("div", { className: "row" }, label, slider, number, rise, bars);
  }));
}
function pull(i, newtons) {
  tween = null;
  state.tensions[i] = newtons;
  state.along = null;
  showControls();
  move();
}
// A number is read by the program, which says what is wrong with it; a decimal comma is a decimal point.
async function typed(i, text) {
  const number = text.trim().replace(/^([+-]?\d*),(\d+)$/, "$1.$2");
  const said = await worker({ ask: "tensions", tensions: [`${body.muscles[i].name}=${number}`] });
  complain("typed", said.error);
  if (said.error) showControls(); else pull(i, said.tensions_n[i]);
}
// Sets a value or a text only if it has changed, so that the layout is not computed again.
const renew = (node, key, value) => { if (node[key] !== value) node[key] = value; };
function showControls() {
  body.muscles.forEach((_, i) => {
    renew(rows[i].slider, "value", String(state.tensions[i]));
    renew(rows[i].number, "value", round(state.tensions[i]));
  });
  ["jaw", "back", "up"].forEach((id, i) => {
    renew(byId(id), "value", String(state.bones[i]));
    renew(byId(`${id}-out`), "textContent", `${round(state.bones[i])} ${i === 0 ? "°" : "mm"}`);
  });
  ["lips", "round"].forEach((id, i) => {
    renew(byId(id), "value", String(state.lips[i]));
    renew(byId(`${id}-out`), "textContent", `${round(state.lips[i])} mm`);
  });
  byId("as-spoken").checked = state.spoken;
  byId("body").value = state.space ? "space" : state.continuum ? "continuum" : "springs";
  byId("gravity").value = state.gravity;
  byId("palate").checked = state.palate;
  byId("mesh").checked = state.mesh;
  document.body.classList.toggle("in-space", state.space);
  if (state.space) showSolidControls();
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

// -- Vowels and solution curves -----------------------------------------------------------------------------------------------------
function makeVowels() {
  const subjects = [...new Set(table.rows.map((f) => f.subject))];
  byId("subject").replaceChildren(...subjects.map((s) => element("option", { value: s, textContent: s })));
  if (!subjects.includes(state.subject)) state.subject = subjects.includes("S2") ? "S2" : subjects[0] ?? "";
  byId("subject").value = state.subject;
  const of = (list) => list.filter((f) => f.subject === state.subject).map((f) => f.vowel);
  const vowels = [...new Set(of(table.rows))], usual = of(table.baselines);
  if (!vowels.includes(state.baseline)) state.baseline = usual[0] ?? vowels[0] ?? "";
  const bases = [state.baseline];
  byId("baseline").replaceChildren(...vowels.map((v) => element("option", { value: v, textContent: v })));
  byId("baseline").value = state.baseline;
  byId("vowel").replaceChildren(...vowels.map((v) => {
    const button = element("button", { type: "button", textContent: v, title: bases.includes(v) ? "the baseline" : `fit /${v}/` });
    button.dataset.vowel = v;
    button.setAttribute("aria-label", `vowel ${v}${bases.includes(v) ? ", the baseline" : ""}`);
    button.addEventListener("click", () => choose(v));
    return button;
  }));
  byId("origin").textContent = `${table.origin}: ${subjects.length} speaker${subjects.length === 1 ? "" : "s"}, ${table.rows.length} vowels measured.`
    + (table.told.length ? ` ${table.told.join(" ")}` : "");
}
// Which muscles pull harder than in the baseline, from a short run of the posterior, which is made in a worker.
function showRises(why = "") {
  byId("rises").textContent = rises ? `${rises.sentences.join(" ")} ` : why;
  if (rises) byId("rises").append(element("small", { textContent: `From 240 draws of the posterior in ${round(rises.seconds)} s, ${body.palate_m === null ? "" : "without palate and teeth, "}probabilities to about 0.05.` }));
  body.muscles.forEach((m, i) => {
    const { rise } = rows[i], said = rises?.muscles.find((r) => r.muscle === m.name);
    const p = said?.p_rises, [low, high] = said?.tension_n_per_m ?? [];
    rise.textContent = !said ? "" : p > 0.99 ? "P > 0.99" : p < 0.01 ? "P < 0.01" : `P ${round(p, 2)}`;
    rise.title = said ? `${m.name}, harder than in /${rises.baseline}/: ${said.word.replace(" harder", "")} (probability ${probability(p)}). 95 % of its tension: ${round(low)} to ${round(high)} N/m${said.mostly_prior ? " (more from prior than data)" : ""}.` : "";
    rise.className = `rise ${said ? said.word.split(" ")[0] : ""}`;
  });
  byId("rise-what").textContent = rises ? `P: pulls harder than in /${rises.baseline}/` : "";
}
async function think(mine, subject, vowel) {
  const clock = performance.now();
  showRises("How sure it is which muscles pull harder is being computed …");
  // The two groups of chains run side by side.
  const row = { subject, vowel, baseline: state.baseline };
  const parts = await Promise.all(thinkers.map((thinker, group) => thinker({ ask: "draws", ...row, group })));
  if (mine !== fitting || parts.some((p) => p.ended)) return;
  const wrong = parts.find((p) => p.error);
  const said = wrong ?? await thinkers[0]({ ask: "verdict", ...row, draws: parts.flatMap((p) => p.draws) });
  if (mine !== fitting || said.ended) return;
  rises = said.error ? null : { ...said, baseline: state.baseline, seconds: (performance.now() - clock) / 1000 };
  showRises(said.error && `No verdict of which muscles pull harder: ${said.error}.`);
}
// Removes the fit that is shown, and drops one that is under way.
function forget(said = "") {
  [fit, rises, spoken] = [null, null, null];
  fitting++;
  byId("valley").hidden = true;
  verdict(said);
  showRises();
}
let fitting = 0;
async function choose(vowel, keep = false) {
  state.vowel = vowel;
  state.along = null;
  const { subject, target } = state;
  showControls();
  if (vowel === state.baseline) {
    forget(`/${vowel}/ is ${subject}’s baseline: every other vowel is compared with it, and the fit takes it for the shape at rest.`);
    if (!keep) { speak(posture(vowel)); plain(body.muscles.map(() => 0), [0, 0, 0]); }
    return;
  }
  const mine = ++fitting;
  verdict(`Fitting ${subject} /${vowel}/ …`);
  rises = null;
  think(mine, subject, vowel);
  const clock = performance.now();
  const walls = walled();
  const ready = !state.continuum === !own.continuum && !walls
    && own.fits?.find((f) => f.subject === subject && f.vowel === vowel && f.baseline === state.baseline && f.target_kind === target && table.own);
  const found = ready || await worker({ ask: "fit", subject, vowel, baseline: state.baseline, target, walls });
  if (mine !== fitting || found.ended) return;
  const said = state.spoken && target === "stretch" && !found.error && await worker({ ask: "spoken", subject, vowel, baseline: state.baseline, target });
  if (mine !== fitting || said?.ended) return;
  if (found.error) {
    forget(found.error);
    show();
    return;
  }
  fit = found;
  spoken = said?.posture ? said : null;
  const took = ready ? "as the file has it" : `${fit.evaluations} equilibria in ${round((performance.now() - clock) / 1000, 2)} s`;
  const count = fit.identifiability?.undetermined ?? 0;
  verdict(`${subject} /${vowel}/ against /${fit.baseline}/${body.palate_m === null ? "" : walls ? ", stopped by palate and teeth" : ", palate and teeth left out"}: ${fit.status.replaceAll("_", " ")}, missed by ${fit.misfit.toExponential(1)}; ${took}.${count ? ` Not unique: ${count} direction${count > 1 ? "s are" : " is"} open.` : ""}${spoken ? ` Shown as spoken: jaw ${round(spoken.posture.jaw_deg)}° open, hyoid ${way(spoken.posture.hyoid_mm[0], ["forward", "back"])}, and the tensions that meet the lengths there.` : state.spoken && target === "stretch" && posture(vowel) ? " Jaw and hyoid stay at rest: those of the vowels are known from /ɯ/ only." : ""}`, fit.alarms.map((a) => a.text));
  byId("valley").hidden = !fit.valley;
  if (fit.valley) drawPath();
  if (keep) { showControls(); show(); } else { speak(posture(vowel)); back(); }
}
// Jaw, hyoid and lips of a vowel. Labels are compared as in the library: upper and lower case are the same, and u is ɯ.
const plainLabel = (vowel) => vowel.toLowerCase().replace(/^u$/, "ɯ");
const posture = (vowel) => Object.entries(body.tract?.posture ?? {}).find(([label]) => plainLabel(label) === plainLabel(vowel))?.[1];
// Lips of a vowel.
function speak(posture) {
  if (state.spoken && posture) state.lips = [posture.lip_opening_mm, posture.lip_protrusion_mm];
}
// With jaw and hyoid of speech other tensions meet the measured lengths than with both at rest.
let spoken = null;
const fitted = () => spoken ? { tensions: spoken.tensions_n, bones: [spoken.posture.jaw_deg, ...spoken.posture.hyoid_mm] }
  : { tensions: body.muscles.map((m) => fit.tensions_n[m.name] ?? 0), bones: [0, 0, 0] };
const back = () => plain(fitted().tensions, fitted().bones);
// What has been changed by hand since the fit was made.
function showChanged() {
  const at = fit && state.along === null && !tween ? fitted() : null;
  const unlike = (a, b) => Math.abs(a - b) > 1e-6 * Math.max(1, Math.abs(b));
  const changed = !at ? [] : [
    ...body.muscles.flatMap((m, i) => unlike(state.tensions[i], at.tensions[i]) ? [`${m.name} ${round(at.tensions[i])} → ${round(state.tensions[i])} N/m`] : []),
    ...["jaw", "hyoid back", "hyoid up"].flatMap((name, i) => unlike(state.bones[i], at.bones[i]) ? [`${name} ${round(at.bones[i])} → ${round(state.bones[i])} ${i ? "mm" : "°"}`] : []),
    ...state.gravity ? ["weight acts"] : [],
  ];
  byId("changed").hidden = !changed.length;
  byId("changed").firstElementChild.textContent = `Changed by hand since: ${changed.join(", ")}.`;
  for (const id of ["verdict", "rises", "rows"]) byId(id).classList.toggle("old", changed.length > 0);
}
// The scene of a fit: it has no weight.
function plain(tensions, bones) {
  if (state.gravity) {
    state.gravity = "";
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
  // Names at the ends of their curves, placed from the top down so that none overlaps another.
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
  [state.along, state.bones] = [along, [0, 0, 0]];
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
  complain("act", said.error);
  if (said.error) {
    [state.gravity, state.palate] = ["", false];
    live.ask({ ask: "act", scene: scene() });
    showControls();
  }
  move();
}
function open() {
  const request = { ask: "open", body: { ...(own.body ?? {}), h_mm: spacing(), continuum: state.continuum }, scene: scene([0, 0, 0], false) };
  const made = live.ask(request);
  complain("open", made.error);
  if (made.error) return false;
  for (const beside of [worker, ...thinkers]) beside(request);
  body = made;
  shape = null;
  // Answers to requests about the body before are not used for this one.
  checked++;
  if (state.tensions.length !== body.muscles.length) state.tensions = body.muscles.map(() => 0);
  draw = makeMouth(byId("mouth"), body);
  byId("sound").hidden = !body.tract;
  sound ??= makeSound(body.means);
  makeRows();
  explain();
  if (state.gravity || walled()) act();
  return true;
}
// Reads a table: its text, or the bytes of a file, which the program decodes, or the page's own table.
const LARGEST_TABLE = 64 << 20;
async function readTable(given = null) {
  const { text = null, file_bytes, file } = given ?? { text: own.table?.text, file: own.table?.file ?? "" };
  const request = { ask: "table", text, file, file_bytes };
  const said = live.ask(request);
  complain("table", said.error);
  if (said.error) return false;
  for (const thinker of thinkers) thinker(request);
  await worker(request);
  let decoded = text;
  if (file_bytes) try { decoded = new TextDecoder("utf-8", { fatal: true }).decode(file_bytes); } catch { decoded = null; }
  table = { ...said, own: !given, file, text: decoded };
  [missing, state.baseline] = [null, ""];
  forget();
  makeVowels();
  return true;
}

// -- The link -----------------------------------------------------------------------------------------------------------------------
// The link contains the user's own table if that is short; otherwise the link names it, and the page asks for it.
const LONGEST_IN_LINK = 6000;
let missing = null;
const unheld = () => missing?.file ?? (table && !table.own && (table.text?.length ?? Infinity) > LONGEST_IN_LINK ? table.file : null);
function link() {
  const q = new URLSearchParams();
  if (missing) for (const key of ["file", "s", "b", "v", "k", "along"]) if (missing.said.has(key)) q.set(key, missing.said.get(key));
  if (state.continuum !== (own.continuum ?? false)) q.set("body", state.continuum ? "continuum" : "springs");
  if (!missing) {
    if (table && !table.own) q.set("file", table.file);
    if (table && !table.own && !unheld()) q.set("table", table.text);
    if (state.subject) q.set("s", state.subject);
    if (state.baseline) q.set("b", state.baseline);
    if (state.vowel) q.set("v", state.vowel);
    q.set("k", state.target);
  }
  const pulled = words(state.tensions.map((t) => Number(t.toPrecision(12))));
  if (pulled.length) q.set("t", pulled.join(","));
  if (state.bones.some((b) => b !== 0)) q.set("bones", state.bones.map((b) => Number(b.toPrecision(12))).join(","));
  if (state.gravity) q.set("gravity", state.gravity);
  q.set("palate", state.palate ? "1" : "0");
  if (state.lips[0] !== 8 || state.lips[1] !== 0) q.set("lips", state.lips.join(","));
  if (!state.spoken) q.set("spoken", "0");
  if (state.space) {
    q.set("body", "space");
    if (activated().length) q.set("a", activated().join(","));
    q.set("view", [...state.view.map(Math.round), state.cut ? 1 : 0].join(","));
  }
  if (!state.mesh) q.set("mesh", "0");
  if (state.along !== null) q.set("along", state.along);
  return "#" + q.toString().replaceAll("%2C", ",").replaceAll("%3D", "=");
}
function remember() {
  if (ready && !testing) try { history.replaceState(null, "", link()); } catch { /* A page without an address has no link. */ }
}
// Sets the state from a link, with a message about what cannot be used; the program says what is wrong with a tension.
const IN_LINKS = ["body", "file", "table", "s", "b", "v", "k", "t", "bones", "gravity", "palate", "lips", "spoken", "mesh", "along", "a", "view"];
async function takeUp(fragment) {
  const q = new URLSearchParams(fragment.replace(/^#/, "")), wrong = [];
  const one = (key, known, usual) => {
    const said = q.get(key);
    if (said === null || known.includes(said)) return said ?? usual;
    wrong.push(`${key}=${said} is none of ${[...new Set(known)].join(", ")}.`);
    return usual;
  };
  for (const key of q.keys()) if (!IN_LINKS.includes(key)) wrong.push(`${key} means nothing in a link.`);
  const bodyName = one("body", ["springs", "continuum", ...hasOwnBody() ? [] : ["space"]], own.continuum ? "continuum" : "springs");
  const continuum = bodyName === "continuum";
  if (continuum !== state.continuum) {
    state.continuum = continuum;
    if (!open()) return;
  }
  const [file, text] = [q.get("file"), q.get("table")];
  if (text !== null) await readTable({ text, file: file ?? "table" });
  else if (file !== null && file !== table.file) missing = { file, said: q, fragment };
  else if (file === null && !table.own) await readTable();
  if (!missing) {
    state.subject = one("s", table.rows.map((r) => r.subject), state.subject);
    state.baseline = one("b", table.rows.filter((r) => r.subject === state.subject).map((r) => r.vowel), "");
  }
  state.target = one("k", ["stretch", "ratio"], "stretch");
  state.gravity = one("gravity", ["upright", "supine", "prone"], "");
  state.palate = one("palate", ["0", "1"], "0") === "1";
  state.mesh = one("mesh", ["0", "1"], "1") === "1";
  state.spoken = one("spoken", ["0", "1"], "1") === "1";
  makeVowels();
  const given = q.get("t")?.split(",").filter((w) => w !== "") ?? [];
  const read = live.ask({ ask: "tensions", tensions: given });
  const numbers = (key, usual, low, high) => {
    const said = q.has(key) ? q.get(key).split(",").map((w) => w.trim() === "" ? NaN : Number(w)) : usual;
    if (said.length === usual.length && said.every((x, i) => x >= low[i] && x <= high[i])) return said;
    wrong.push(`${key}=${q.get(key)} is not ${usual.length} numbers from ${low.join(", ")} to ${high.join(", ")}.`);
    return usual.slice();
  };
  state.bones = numbers("bones", [0, 0, 0], [0, -12, -12], [15, 12, 12]);
  state.lips = numbers("lips", [8, 0], [1, 0], [20, 8]);
  state.tensions = read.error ? body.muscles.map(() => 0) : read.tensions_n;
  if (read.error) wrong.unshift(read.error);
  act();
  showControls();
  const vowel = missing ? null : one("v", table.rows.filter((r) => r.subject === state.subject).map((r) => r.vowel), null);
  if (missing) {
    [state.vowel, state.along] = ["", null];
    forget(`This link needs the table ${file}, which it does not contain: open that table below. Until then no vowel is fitted.`);
  } else if (vowel) {
    await choose(vowel, q.has("t"));
    const [along, most] = [q.get("along"), fit?.valley ? fit.valley.points.length - 1 : 0];
    if (along !== null && !read.error) state.along = numbers("along", [0], [0], [most])[0];
    showControls();
    showChanged();
  }
  if (bodyName === "space") await takeUpSpace(q, numbers, wrong); else state.space = false;
  showControls();
  complain("link", wrong.join(" "));
}
async function takeUpSpace(q, numbers, wrong) {
  const [turn, tilt, cut] = numbers("view", [40, 15, 0], [-180, -90, 0], [180, 90, 1]);
  [state.view, state.cut] = [[turn, tilt], cut > 0];
  if (!await enterSpace()) return;
  state.activations.fill(0);
  for (const word of q.get("a")?.split(",").filter((w) => w !== "") ?? []) {
    const [name, value] = word.split("="), i = solid.body.muscles.indexOf(name), x = Number(value);
    if (i >= 0 && value !== "" && x >= 0 && x <= 1) state.activations[i] = x;
    else wrong.push(`a=${word} is no activation from 0 to 1 of one of ${solid.body.muscles.join(", ")}.`);
  }
  pullInSpace();
}

// -- Files --------------------------------------------------------------------------------------------------------------------------
const made = () => `tongue-fit ${body.version}, tongue.html${link()}`;
// The texts above and below a saved picture.
function caption() {
  if (state.space) return { title: "A tongue in space at these activations", lines: [`Activations, both sides: ${activated().join(", ") || "none"}.`, `${solid.body.what}. ${byId("found").textContent}`] };
  const changed = byId("changed").hidden ? "" : ", changed by hand";
  const title = fit ? `${fit.subject} /${fit.vowel}/ against /${fit.baseline}/, fitted by ${fit.target_kind === "ratio" ? "length ratios" : "stretches"}${changed}` : "A tongue whose muscles pull as given";
  const pulled = body.muscles.flatMap((m, i) => state.tensions[i] > 0.05 ? [`${m.name} ${round(state.tensions[i])}`] : []);
  const [jaw, back, up] = state.bones, weight = { "": "no weight", upright: "weight, sitting", supine: "weight, on the back", prone: "weight, face down" }[state.gravity];
  return { title, lines: [
    `Tensions, N per metre of thickness: ${pulled.join(", ") || "none"}.`,
    `Jaw ${round(jaw)}° open; hyoid ${way(back, ["forward", "back"])}, ${way(up, ["down", "up"])}; ${weight}; palate and teeth ${walled() ? "stop the tongue" : "do not act"}; ${body.what}.`,
    ...byId("beyond").hidden ? [] : [byId("beyond").textContent],
    ...fit && rises && !changed ? [rises.sentences.join(" ")] : [],
  ] };
}
// The picture that is shown as SVG, with the page's styles in it.
function picture() {
  if (!state.space) return pictureText(byId("mouth"), made(), caption());
  const svg = solid.picture(state);
  const aside = element("div", { hidden: true }, svg);
  byId("stage").append(aside);
  const text = pictureText(svg, made(), caption());
  aside.remove();
  return text;
}
const fileName = (ending) => `tongue${state.vowel ? `-${state.subject}-${state.vowel}` : ""}.${ending}`.replace(/[^\p{L}\p{N}.-]+/gu, "-");
function save(blob, name) {
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
async function png() {
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(picture())}`;
  await image.decode();
  const canvas = element("canvas", { width: 2 * image.naturalWidth, height: 2 * image.naturalHeight });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

// A swipe that begins on a slider scrolls the page: a touched slider acts once the finger moves along it or is lifted without moving.
function guardSwipes() {
  let held = null;
  const act = (slider) => slider.dispatchEvent(new Event("input", { bubbles: true }));
  const way = (e) => [Math.abs(e.clientX - held.x), Math.abs(e.clientY - held.y)];
  const let_go = (meant) => {
    const { slider, value } = held;
    held = null;
    if (!meant) slider.value = value;
    if (meant || slider.value !== value) act(slider);
  };
  const on = (name, work) => document.addEventListener(name, work, true);
  on("pointerdown", (e) => {
    const slider = e.pointerType === "mouse" ? null : e.target.closest?.("input[type=range]");
    held = slider ? { slider, value: slider.value, x: e.clientX, y: e.clientY, meant: false } : null;
  });
  on("pointermove", (e) => { if (held) { const [x, y] = way(e); held.meant ||= x > Math.max(8, 2 * y); } });
  on("input", (e) => { if (held && e.target === held.slider && !held.meant && e.isTrusted) e.stopImmediatePropagation(); });
  on("pointerup", (e) => { if (held) { const [x, y] = way(e); let_go(held.meant || y < 8); } });
  on("pointercancel", () => { if (held) let_go(false); });
}

// -- Start --------------------------------------------------------------------------------------------------------------------------
function listen() {
  guardSwipes();
  listenInSpace();
  byId("subject").addEventListener("change", () => { [state.subject, state.baseline] = [byId("subject").value, ""]; makeVowels(); if (state.vowel) choose(state.vowel); });
  byId("baseline").addEventListener("change", () => { state.baseline = byId("baseline").value; makeVowels(); showControls(); if (state.vowel) choose(state.vowel); });
  byId("changed").querySelector("button").addEventListener("click", back);
  for (const radio of document.querySelectorAll("[name=target]")) radio.addEventListener("change", () => { state.target = radio.value; if (state.vowel) choose(state.vowel); });
  byId("along").addEventListener("input", () => slide(Number(byId("along").value)));
  byId("slack").addEventListener("click", () => { [state.vowel, state.along] = ["", null]; forget(); glide(body.muscles.map(() => 0), [0, 0, 0]); showControls(); });
  ["jaw", "back", "up"].forEach((id, i) => byId(id).addEventListener("input", () => { tween = null; state.bones[i] = Number(byId(id).value); showControls(); move(); }));
  ["lips", "round"].forEach((id, i) => byId(id).addEventListener("input", () => { state.lips[i] = Number(byId(id).value); showControls(); move(); }));
  byId("as-spoken").addEventListener("change", () => { state.spoken = byId("as-spoken").checked; if (state.vowel) choose(state.vowel); });
  byId("play").addEventListener("click", () => sound.toggle());
  byId("volume").addEventListener("input", () => sound.level());
  window.addEventListener("keydown", (e) => {
    const typing = e.target.closest?.("select, textarea, input:not([type=range]):not([type=checkbox]):not([type=radio])");
    if (e.key === "p" && !typing && !e.ctrlKey && !e.metaKey && !e.altKey && !e.repeat && body.tract && !state.space) { e.preventDefault(); sound.toggle(); }
  });
  byId("body").addEventListener("change", () => {
    if (byId("body").value === "space") { enterSpace().then((entered) => { if (!entered) showControls(); }); return; }
    state.space = false;
    state.continuum = byId("body").value === "continuum";
    verdict("");
    if (open()) { act(); showControls(); if (state.vowel) choose(state.vowel); }
  });
  byId("gravity").addEventListener("change", () => { state.gravity = byId("gravity").value; act(); });
  byId("palate").addEventListener("change", () => { state.palate = byId("palate").checked; act(); if (fit) choose(state.vowel); });
  byId("mesh").addEventListener("change", () => { state.mesh = byId("mesh").checked; show(); remember(); });
  byId("table").addEventListener("change", async () => {
    const file = byId("table").files[0];
    if (!file) return;
    const waiting = missing?.file === file.name ? missing.fragment : null;
    const file_bytes = new Uint8Array(await file.slice(0, LARGEST_TABLE + 1).arrayBuffer());
    if (!await readTable({ file_bytes, file: file.name })) return;
    if (waiting) { await takeUp(waiting); return; }
    [state.vowel, state.along] = ["", null];
    verdict("Choose a vowel.");
    showControls();
    show();
  });
  byId("save-svg").addEventListener("click", () => save(new Blob([picture()], { type: "image/svg+xml" }), fileName("svg")));
  byId("save-png").addEventListener("click", async () => save(await png(), fileName("png")));
  byId("copy-link").addEventListener("click", async () => {
    const address = location.href.split("#")[0] + link();
    remember();
    const holds = unheld() ? `it holds all that is set here but the table ${unheld()}, which has to be opened with it` : "it holds all that is set here";
    try { await navigator.clipboard.writeText(address); byId("found").textContent = `The link is copied: ${holds}.`; }
    catch { byId("found").textContent = `The link is in the address bar: ${holds}.`; }
  });
  byId("hall").addEventListener("click", () => byId("hall").setAttribute("aria-pressed", document.body.classList.toggle("hall")));
  byId("theme").addEventListener("click", () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    root.dataset.theme = dark ? "light" : "dark";
  });
  window.addEventListener("resize", () => { if (fit?.valley) drawPath(); if (state.space) paint(); });
  window.addEventListener("hashchange", () => takeUp(location.hash));
}
const testing = opening === "#self-test";
async function begin() {
  const module = await WebAssembly.compile(await unpacked());
  live = makeEngine(module);
  worker = makeWorker(module);
  thinkers = [makeWorker(module), makeWorker(module)];
  if (!open() || !await readTable()) return;
  byId("made").textContent = `tongue-fit ${body.version}${own.command ? ` · ${own.command}` : ""} · ${body.what}`;
  if (body.palate_m === null) byId("palate").closest("label").hidden = true;
  if (!body.bones.some((b) => b.name === "hyoid") || !body.bones.some((b) => b.name === "mental_spine")) document.querySelector(".bones.plane").hidden = true;
  listen();
  showControls();
  move();
  const first = table.fits.find((f) => f.subject === state.subject && f.vowel === "a") ?? table.fits[0];
  if (opening.length > 1 && !testing) await takeUp(opening);
  else if (first) { state.subject = first.subject; makeVowels(); await choose(first.vowel); }
  ready = true;
  remember();
  document.body.dataset.ready = "yes";
}
begin().catch((error) => { errors.push(String(error)); complain("page", `This page cannot run here: ${error}. It needs a browser of 2023 or newer.`); });
