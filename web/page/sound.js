// The sound of the vowel: a chart of its first two formants, and a voice through resonators in cascade (Klatt 1980).
function makeSound(means) {
  // The vowel whose mean is nearest, in Bark (Traunmüller 1990).
  const bark = (hz) => 26.81 * hz / (1960 + hz) - 0.53;
  const apart = (m, [f1, f2]) => Math.hypot(bark(m.f1_hz) - bark(f1), bark(m.f2_hz) - bark(f2));
  const nearest = (formants) => means.reduce((a, b) => apart(b, formants) < apart(a, formants) ? b : a).vowel;
  const svg = byId("chart"), wide = 320, high = 220, [left, below, right, top] = [56, 36, 8, 8];
  const within = (v, [from, to]) => Math.min(1, Math.max(0, (v - from) / (to - from)));
  const [f2s, f1s] = [[2600, 600], [200, 950]];
  const x = (f2) => left + (wide - left - right) * within(f2, f2s), y = (f1) => top + (high - top - below) * within(f1, f1s);
  const text = (at, said, more = {}) => make("text", { x: at[0], y: at[1], ...more }, said);
  const rule = (a, b) => make("line", { class: "rule", x1: a[0], y1: a[1], x2: b[0], y2: b[1] });
  const here = make("circle", { class: "here", r: 6 });
  svg.setAttribute("viewBox", `0 0 ${wide} ${high}`);
  svg.replaceChildren(...svg.querySelectorAll("title, desc"),
    ...[1000, 1500, 2000, 2500].flatMap((f) => [rule([x(f), top], [x(f), high - below]), text([x(f), high - below + 13], f)]),
    ...[300, 500, 700, 900].flatMap((f) => [rule([left, y(f)], [wide - right, y(f)]), text([left - 18, y(f)], f)]),
    text([(left + wide) / 2, high - 8], "F2 (Hz)"), text([8, (top + high - below) / 2], "F1 (Hz)", { transform: `rotate(-90 8 ${(top + high - below) / 2})` }),
    ...means.map((m) => text([x(m.f2_hz), y(m.f1_hz)], m.vowel, { class: "mean" })), here);

  let audio = null, source, loud, filters = [], playing = false, last = null;
  // A low-pass of second order is Klatt's resonator; its Q is in decibels.
  const quality = (f, b) => 20 * Math.log10(f / Math.max(b, 30));
  const tune = (soon) => filters.forEach((filter, i) => {
    const at = audio.currentTime, [f, b] = [last.formants[i], last.bandwidths[i]];
    if (soon) { filter.frequency.setTargetAtTime(f, at, 0.02); filter.Q.setTargetAtTime(quality(f, b), at, 0.02); }
    else { filter.frequency.value = f; filter.Q.value = quality(f, b); }
  });
  // The voice's harmonics fall by 12 dB an octave at the glottis, and the lips raise them by 6.
  const begin = () => {
    audio = new AudioContext();
    const count = 64, zeros = new Float32Array(count), falling = Float32Array.from({ length: count }, (_, n) => n ? 1 / n : 0);
    source = new OscillatorNode(audio, { frequency: 115, periodicWave: audio.createPeriodicWave(zeros, falling, { disableNormalization: true }) });
    filters = Array.from(last.formants, () => new BiquadFilterNode(audio, { type: "lowpass" }));
    loud = new GainNode(audio, { gain: 0 });
    const even = new DynamicsCompressorNode(audio, { threshold: -30, ratio: 12, knee: 6 });
    [source, ...filters, even, loud, audio.destination].reduce((from, to) => { from.connect(to); return to; });
    tune(false);
    source.start();
  };
  const volume = () => Number(byId("volume").value) ** 2;
  const level = () => loud?.gain.setTargetAtTime(playing && last ? volume() : 0, audio.currentTime, 0.03);
  const say = () => {
    byId("play").setAttribute("aria-pressed", playing);
    byId("play").textContent = playing ? "Stop (p)" : "Play (p)";
  };
  const toggle = () => {
    playing = !playing;
    if (playing && last && !audio) begin();
    audio?.resume();
    level();
    say();
  };
  say();
  return {
    toggle, level,
    playing: () => playing,
    context: () => audio,
    // The voice has the formants of the frame; it is silent where the airway is closed.
    hear(frame) {
      last = frame?.formants?.[0] > 0 ? frame : null;
      set(here, "display", last ? "inline" : "none");
      if (last) {
        set(here, "cx", x(last.formants[1])); set(here, "cy", y(last.formants[0]));
        if (audio) tune(true); else if (playing) begin();
      }
      level();
    },
    // The formants as text.
    tell() {
      const told = last ? `${means.length ? `Nearest to /${nearest(last.formants)}/: ` : ""}F1 ${Math.round(last.formants[0])}, F2 ${Math.round(last.formants[1])}, F3 ${Math.round(last.formants[2])} Hz` : "The airway is closed: nothing is heard.";
      byId("formants").textContent = told;
      byId("chart-text").textContent = `${told}. Letters: published means of Japanese men.`;
    },
  };
}
