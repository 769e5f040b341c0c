// Answers of the library in the page to invalid requests and to numbers far out of range, each with what was asked.
(() => {
  const asked = [
    () => null,
    () => ({ask: 'fit'}),
    () => ({ask: 'nothing'}),
    () => ({ask: 'fit', subject: '', vowel: '', target: 'ratio'}),
    () => ({ask: 'fit', subject: 'S2', vowel: 'a', target: 'width'}),
    () => ({ask: 'place', positions_m: []}),
    () => ({ask: 'place', positions_m: [[1e308, 1e308]]}),
    () => ({ask: 'simulate', tensions: ['GGa=1e300'], scene: scene()}),
    () => ({ask: 'simulate', tensions: ['GGa=5e5', 'HGp=3e5'], scene: scene([59, 40, -40])}),
    () => ({ask: 'simulate', tensions: [], scene: scene([1e9, 0, 0])}),
    () => ({ask: 'open', body: {h_mm: 1e-9}, scene: scene()}),
    () => ({ask: 'open', body: {h_mm: -1}, scene: scene()}),
    () => ({ask: 'open', body: {h_mm: 5, mesh: '{}'}, scene: scene()}),
    () => ({ask: 'open', body: {h_mm: 5, anatomy: 'outline = 3'}, scene: scene()}),
  ];
  const tensions = [NaN, -1, Infinity, 1e300, 1e9, 0, 1e5, 1e-300];
  const bones = [[NaN, Infinity, -Infinity], [1e300, 1e300, 1e300], [60, 0, 0]];
  return [
    ...asked.map((request) => [String(request), JSON.stringify(live.ask(request()))]),
    ...bones.map((b) => [String(b), 'status ' + JSON.stringify(live.frame(b, tensions, body.nodes_m.length))]),
  ];
})()
