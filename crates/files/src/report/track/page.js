'use strict';
// Draws the figure of a recording when it is opened. Numbers are packed, two characters each, between two ends.
const DIGITS = 'ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_';
const unpack = ([low, high, text]) => {
  const out = new Float64Array(text.length / 2);
  for (let i = 0; i < out.length; i++) {
    const code = 64 * DIGITS.indexOf(text[2 * i]) + DIGITS.indexOf(text[2 * i + 1]);
    out[i] = code === 4095 ? NaN : low + (high - low) * code / 4094;
  }
  return out;
};
const json = element => JSON.parse(element.textContent);
const body = json(document.getElementById('body'));
const make = (name, attributes, parent, text) => {
  const e = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  if (text !== undefined) e.textContent = text;
  return parent.appendChild(e);
};
const nice = v => { const ten = 10 ** Math.floor(Math.log10(v)); return [1, 2, 5, 10].map(n => n * ten).find(n => n >= v * .999); };

function figure(svg, data, what) {
  svg.replaceChildren();
  const times = unpack(data.times), n = times.length, left = 90, right = 980, high = 62, gap = 14, top = data.sound ? 78 : 24;
  const from = times[0], to = Math.max(times[n - 1], from + 1e-6), x = t => left + (right - left) * (t - from) / (to - from);
  const panels = body.muscles.map(([name, known], i) => ({ name, known, unit: 'N/m', values: data[what][i].map(unpack) }));
  panels.push({ name: 'RMS', known: true, unit: 'mm', values: [unpack(data.rms_mm)] });
  const foot = top + panels.length * (high + gap);
  svg.setAttribute('viewBox', `0 0 1000 ${foot + 44}`);
  const hatch = make('pattern', { id: 'hatch', width: 6, height: 6, patternUnits: 'userSpaceOnUse', patternTransform: 'rotate(45)' }, make('defs', {}, svg));
  make('rect', { width: 2.5, height: 6, fill: '#c4c4c4' }, hatch);
  const edge = i => i < 1 ? times[0] : i >= n ? times[n - 1] : (times[i - 1] + times[i]) / 2;
  [...data.doubtful].forEach((bad, i) => {
    if (bad === '1') make('rect', { x: x(edge(i)), y: top, width: Math.max(1, x(edge(i + 1)) - x(edge(i))), height: foot - top, fill: '#ffe3c2' }, svg);
  });
  for (const [a, b, name] of data.labels) {
    const [p, q] = [a, b].map(t => x(Math.min(to, Math.max(from, t))));
    for (const at of [p, q]) make('line', { x1: at, x2: at, y1: top - 4, y2: foot, stroke: '#999', 'stroke-dasharray': '4 4' }, svg);
    if (7 * name.length < q - p) make('text', { x: (p + q) / 2, y: 14, 'text-anchor': 'middle' }, svg, name);
  }
  if (data.sound) {
    const [start, width, ends] = data.sound, [low, upper] = ends.map(unpack), loudest = Math.max(1e-9, ...upper, ...low.map(v => -v));
    const at = (v, k) => `${x(start + width * (k + .5)).toFixed(1)} ${(46 - 24 * v[k] / loudest).toFixed(1)}`, bins = [...low.keys()];
    make('path', { d: `M${bins.map(k => at(upper, k)).concat(bins.reverse().map(k => at(low, k))).join('L')}Z`, fill: '#636363' }, svg);
    make('text', { x: 4, y: 50 }, svg, 'sound');
  }
  panels.forEach((panel, i) => {
    const [middle, low, upper] = panel.values, base = top + i * (high + gap) + high;
    const all = panel.values.flatMap(v => [...v]).filter(Number.isFinite);
    const least = Math.min(0, ...all), most = Math.max(1e-9, ...all), y = v => base - high * (v - least) / (most - least);
    const path = (v, backwards) => {
      const at = [...v.keys()].filter(k => Number.isFinite(v[k]));
      return (backwards ? at.reverse() : at).map(k => `${x(times[k]).toFixed(1)} ${y(v[k]).toFixed(1)}`);
    };
    if (low) make('path', { d: `M${path(upper).concat(path(low, true)).join('L')}Z`, fill: panel.known ? '#9ecae1' : 'url(#hatch)' }, svg);
    const line = path(middle);
    if (line.length) make('path', { d: `M${line.join('L')}`, fill: 'none', stroke: panel.known ? '#08519c' : '#888', 'stroke-width': 1.8 }, svg);
    make('path', { d: `M${left} ${base - high}V${base}`, stroke: '#222', fill: 'none' }, svg);
    make('path', { d: `M${left} ${y(0)}H${right}`, stroke: '#222', fill: 'none' }, svg);
    const step = nice((most - least) / 4);
    for (let v = Math.ceil(least / step) * step; v <= most; v += step) make('text', { x: left - 6, y: y(v) + 4, 'text-anchor': 'end' }, svg, +v.toFixed(6));
    make('text', { x: 4, y: base - high / 2, 'font-weight': panel.known ? 700 : 400 }, svg, panel.name);
    make('text', { x: 4, y: base - high / 2 + 15 }, svg, panel.unit);
  });
  const step = nice((to - from) / 6);
  for (let t = Math.ceil(from / step) * step; t <= to; t += step) make('text', { x: x(t), y: foot + 14, 'text-anchor': 'middle' }, svg, +t.toFixed(6));
  make('text', { x: (left + right) / 2, y: foot + 34, 'text-anchor': 'middle' }, svg, 'time (s)');
  return x;
}

function player(parent, data) {
  const times = unpack(data.shown), nodes = unpack(data.nodes), rest = unpack(data.rest), tensions = unpack(data.shown_tensions);
  const marks = unpack(data.marks), count = rest.length, muscles = body.muscles.length, points = marks.length / times.length;
  if (!times.length) return;
  const side = data.mirrored ? -1 : 1, palate = unpack(body.palate);
  const all = [nodes, rest, palate], along = axis => all.flatMap(v => [...v].filter((_, i) => i % 2 === axis && Number.isFinite(v[i])));
  const range = v => v.reduce(([a, b], c) => [Math.min(a, c), Math.max(b, c)], [Infinity, -Infinity]);
  const [[x0, x1], [y0, y1]] = [range(along(0).map(v => side * v)), range(along(1))], scale = 560 / (x1 - x0), strongest = Math.max(...tensions, 1e-9);
  const put = (v, i) => `${(20 + scale * (side * v[2 * i] - x0)).toFixed(1)} ${(20 + scale * (y1 - v[2 * i + 1])).toFixed(1)}`;
  const svg = make('svg', { viewBox: `0 0 780 ${40 + scale * (y1 - y0)}`, role: 'img', 'aria-label': 'Measured points over the simulated tongue' }, parent);
  const d = (v, at, closed) => `M${at.map(i => put(v, i)).join('L')}${closed ? 'Z' : ''}`;
  for (const outline of body.outlines) make('path', { d: d(rest, outline, true), fill: '#eee', stroke: '#aaa' }, svg);
  const edges = body.outlines.map(() => make('path', { fill: 'none', stroke: '#444', 'stroke-width': 2 }, svg));
  const lines = body.lines.map(l => make('path', { fill: 'none', stroke: l.colour, 'stroke-width': l.number === null ? 1 : 4, 'stroke-linecap': 'round' }, svg));
  const bones = body.bones.map(() => make('circle', { r: 5, fill: '#fff', stroke: '#222' }, svg));
  const dots = Array.from({ length: points / 2 }, () => make('circle', { r: 4, fill: '#111', stroke: '#fff' }, svg));
  if (palate.length > 2) make('path', { d: d(palate, [...Array(palate.length / 2).keys()]), fill: 'none', stroke: '#8c510a', 'stroke-width': 2 }, svg);
  const key = ['grey: at rest', 'dots: measured', palate.length > 2 ? 'brown: palate' : ''].filter(Boolean);
  key.forEach((text, i) => make('text', { x: 640, y: 30 + 18 * i }, svg, text));
  const pulling = body.lines.filter(l => l.number !== null);
  const numbers = pulling.map((l, i) => {
    make('rect', { x: 640, y: 94 + 20 * i, width: 14, height: 12, fill: l.colour, stroke: '#222' }, svg);
    return make('text', { x: 660, y: 105 + 20 * i }, svg);
  });
  const clock = make('text', { x: 640, y: 124 + 20 * pulling.length, 'font-weight': 700 }, svg);
  const controls = parent.appendChild(document.createElement('p'));
  const button = controls.appendChild(document.createElement('button')), bar = controls.appendChild(document.createElement('input'));
  button.type = 'button';
  Object.assign(bar, { type: 'range', min: 0, max: times.length - 1, step: 1, value: 0 });
  bar.setAttribute('aria-label', 'Frame');
  bar.style.width = '60%';
  const show = () => {
    const t = Number(bar.value), v = nodes.subarray(t * count, (t + 1) * count), f = tensions.subarray(t * muscles, (t + 1) * muscles);
    edges.forEach((e, i) => e.setAttribute('d', d(v, body.outlines[i], true)));
    lines.forEach((e, i) => {
      const { nodes: at, number } = body.lines[i];
      e.setAttribute('d', d(v, at));
      e.setAttribute('stroke-opacity', number === null ? .4 : .12 + .88 * f[number] / strongest);
    });
    const place = (e, v, i) => {
      const [x, y] = put(v, i).split(' ');
      e.setAttribute('visibility', x === 'NaN' ? 'hidden' : 'visible');
      if (x !== 'NaN') { e.setAttribute('cx', x); e.setAttribute('cy', y); }
    };
    bones.forEach((e, i) => place(e, v, body.bones[i]));
    dots.forEach((e, i) => place(e, marks.subarray(t * points, (t + 1) * points), i));
    numbers.forEach((e, i) => { e.textContent = `${pulling[i].name} ${Math.abs(f[pulling[i].number]).toFixed(1)} N/m`; });
    clock.textContent = `${times[t].toFixed(2)} s`;
  };
  let playing = 0, begun = 0;
  const stop = () => { cancelAnimationFrame(playing); playing = 0; button.textContent = 'Play'; };
  const span = times[times.length - 1] - times[0] || 1;
  const step = now => {
    const at = times[0] + (now - begun) / 1000 % span;
    bar.value = Math.max(0, times.findLastIndex(t => t <= at));
    show();
    playing = requestAnimationFrame(step);
  };
  bar.addEventListener('input', () => { stop(); show(); });
  button.addEventListener('click', () => {
    if (playing) return stop();
    begun = performance.now() - 1000 * (times[Number(bar.value)] - times[0]);
    button.textContent = 'Pause';
    playing = requestAnimationFrame(step);
  });
  stop();
  show();
}

for (const recording of document.querySelectorAll('details.recording')) {
  const open = () => {
    if (!recording.open || recording.dataset.drawn) return;
    recording.dataset.drawn = 'yes';
    const data = json(recording.querySelector('script')), box = recording.appendChild(document.createElement('div'));
    box.className = 'figure wide';
    const label = box.appendChild(document.createElement('label'));
    label.append('Show ');
    const choice = label.appendChild(document.createElement('select'));
    for (const what of ['courses', 'tensions']) choice.appendChild(new Option(what, what));
    const svg = make('svg', { role: 'img', 'aria-label': 'Tensions over time with 95 % intervals' }, box);
    const draw = () => figure(svg, data, choice.value);
    choice.addEventListener('change', draw);
    draw();
    player(box, data);
  };
  recording.addEventListener('toggle', open);
  open();
}
document.body.dataset.ready = 'yes';
