(() => {
  const all = [...document.querySelectorAll('button, select, input, summary')].filter((c) => c.offsetParent !== null && !c.disabled);
  const small = all.filter((c) => { const b = c.getBoundingClientRect(); return b.width < 24 || b.height < 24; });
  const covered = all.toReversed().filter((c) => {
    c.focus();
    const b = c.getBoundingClientRect();
    const at = document.elementFromPoint(b.x + b.width / 2, b.y + b.height / 2);
    return !(at && (c.contains(at) || at.contains(c) && at.tagName === 'LABEL'));
  });
  const said = (c) => c.id || c.textContent || c.type;
  return { count: all.length, small: small.map(said), covered: covered.map(said), wide: document.documentElement.scrollWidth > innerWidth };
})()
