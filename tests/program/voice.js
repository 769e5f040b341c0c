(async () => {
  const rate = 44100, context = new OfflineAudioContext(1, 4 * rate, rate), resume = context.resume.bind(context);
  context.resume = () => Promise.resolve();
  window.AudioContext = function () { return context; };
  const frame = (t) => live.frame([8 * t % 15, 0, 0, 8 + 4 * Math.sin(9 * t), 0], body.muscles.map((_, m) => 20 + 20 * Math.sin(3 * t + m)), body.nodes_m.length);
  const silent = !sound.playing() && sound.context() === null;
  sound.hear(frame(0));
  sound.toggle();
  for (let k = 1; k < 117; k++) context.suspend(k / 30).then(() => { sound.hear(frame(k / 30)); if (k === 105) sound.toggle(); resume(); });
  const heard = (await context.startRendering()).getChannelData(0);
  const peak = (from, to) => heard.slice(from * rate, to * rate).reduce((most, x) => Math.max(most, Math.abs(x)), 0);
  let [near, between] = [0, 0];
  for (let i = rate / 10; i < 3.4 * rate; i++) {
    const step = Math.abs(heard[i] - heard[i - 1]);
    if (i % (rate / 30) < 0.004 * rate) near = Math.max(near, step); else between = Math.max(between, step);
  }
  return { silent, near, between, first: peak(0, 0.005), all: peak(0, 3.5), last: peak(3.9, 4) };
})()
