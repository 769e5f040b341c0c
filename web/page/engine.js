"use strict";
// The library behind its C interface: requests and answers are JSON, a frame is numbers. A worker consists of this file alone.
function makeEngine(module) {
  let instance;
  const view = () => new DataView(instance.exports.memory.buffer);
  const bytes = (at, length) => new Uint8Array(instance.exports.memory.buffer, at, length);
  let said = "";
  // The functions of a system that the standard library needs: no arguments, no files, a clock, and numbers that are always the same.
  const system = {
    environ_get: () => 0,
    environ_sizes_get: (count, size) => { view().setUint32(count, 0, true); view().setUint32(size, 0, true); return 0; },
    clock_time_get: (_id, _precision, at) => { view().setBigUint64(at, BigInt(Math.round(performance.now() * 1e6)), true); return 0; },
    random_get: (at, length) => { bytes(at, length).fill(7); return 0; },
    fd_write: (_file, parts, count, written) => {
      let total = 0;
      for (let i = 0; i < count; i++) {
        const [at, length] = [view().getUint32(parts + 8 * i, true), view().getUint32(parts + 8 * i + 4, true)];
        said += new TextDecoder().decode(bytes(at, length));
        total += length;
      }
      view().setUint32(written, total, true);
      return 0;
    },
    proc_exit: () => { throw new Error("exit"); },
  };
  const stub = new Proxy(system, { get: (known, name) => known[name] ?? (() => 52) });
  const start = () => {
    instance = new WebAssembly.Instance(module, { wasi_snapshot_preview1: stub });
    instance.exports._initialize?.();
  };
  start();
  let opened;
  // The bytes of a file, if there are any, follow the request and a zero byte.
  const send = (request) => {
    const file = request?.file_bytes;
    const text = new TextEncoder().encode(JSON.stringify(file ? { ...request, file_bytes: undefined } : request));
    const e = instance.exports;
    const at = e.input(text.length + (file ? 1 + file.length : 0));
    bytes(at, text.length).set(text);
    if (file) { bytes(at + text.length, 1)[0] = 0; bytes(at + text.length + 1, file.length).set(file); }
    const length = e.call();
    return JSON.parse(new TextDecoder().decode(bytes(e.output(), length)));
  };
  // If the library stops, that is its defect, and the page goes on with a new one.
  const guarded = (work) => {
    try { return work(); } catch (error) {
      const why = said.trim() || String(error);
      said = "";
      start();
      if (opened) send(opened);
      return { error: `tongue-fit itself failed, which is a defect: ${why}` };
    }
  };
  return {
    ask(request) {
      const answer = guarded(() => send(request));
      if (request?.ask === "open" && !answer.error) opened = request;
      return answer;
    },
    // Input: jaw, hyoid back and up, lips opened and protruded, and the tensions. Engine::frame describes the output.
    frame(bones, tensions, nodes) {
      const e = instance.exports;
      const heard = 5, many = 5 + 2 * tensions.length + 2 * nodes + 2 * heard + 1;
      const numbers = () => new Float64Array(e.memory.buffer, e.numbers(), many);
      numbers().set(bones);
      numbers().set(tensions, 5);
      const good = guarded(() => e.frame());
      if (good.error) return good;
      const n = numbers(), lengths = 5 + tensions.length;
      return { converged: good === 1, low: n[0], high: n[1], guarded: n[2], iterations: n[3], residual: n[4],
        lengths: n.slice(lengths, lengths + tensions.length), at: n.slice(lengths + tensions.length, many - 1 - 2 * heard),
        formants: n.slice(many - 1 - 2 * heard, many - 1 - heard), bandwidths: n.slice(many - 1 - heard, many - 1), beyond: n[many - 1] };
    },
  };
}
