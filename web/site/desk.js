/*
 * Runs in a worker: passes calls to the crates, and returns their results or the sentences of their errors.
 */
(() => {
  "use strict";
  /** @type {any} */
  const here = self;
  /** @type {any} */
  let desk = null;
  /** @type {any} */
  let live = null;
  let fatal = "";
  here.stretchProgress = (/** @type {string} */ text) => here.postMessage({ progress: text });
  here.stretchFailed = (/** @type {string} */ text) => { fatal = text; };

  /** Calls that are not methods of the class `Desk`. @type {Record<string, (...args: any[]) => any>} */
  const others = {
    begin(module) {
      wasm_bindgen.initSync({ module });
      desk = new wasm_bindgen.Desk();
      return { version: wasm_bindgen.version(), models: wasm_bindgen.model_names().trim().split("\n") };
    },
    async read(file, name, asked) {
      return desk.read(name, new Uint8Array(await file.arrayBuffer()), asked);
    },
    sample: (seed) => wasm_bindgen.sample(seed),
    golden: () => wasm_bindgen.golden(),
    sound: () => wasm_bindgen.sound(),
    listen(form, adc, rate, record) {
      live = form === "frames" ? wasm_bindgen.Live.frames(adc, record) : wasm_bindgen.Live.numbers(rate, record);
      return live.header();
    },
    heard(bytes, now) {
      const rows = live.take(bytes, now);
      return { rows, lines: live.lines(), status: live.status(), doubts: live.doubts() };
    },
  };

  here.onmessage = async (/** @type {MessageEvent} */ { data: { id, method, args } }) => {
    try {
      const value = await (others[method] ? others[method](...args) : desk[method](...args));
      here.postMessage({ id, value });
    } catch (/** @type {any} */ error) {
      const isDead = error instanceof WebAssembly.RuntimeError;
      const why = isDead ? `this is a fault of the page, or memory ran out: ${fatal || error.message}` : error.message;
      here.postMessage({ id, error: String(why || error), isDead });
    }
  };
})();
