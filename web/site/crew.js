/*
 * Workers, each with the crates of stretch in it. They are made of the page's own text: a page that was opened from a disk
 * may load nothing.
 */

/** @typedef {{resolve: (value: any) => void, reject: (why: Error) => void}} Waiting */

/** What workers were told to stop for. */
class Cancelled extends Error {}

const parts = {
  /** @param {string} id */
  text(id) {
    const element = document.getElementById(id);
    if (!element || element.textContent === null) throw new Error(`the page has no part ${id}`);
    return element.textContent;
  },
  /** @type {Promise<WebAssembly.Module>|null} */
  module: null,
  /** @type {string|null} */
  worker: null,
};

/** The crates, unpacked once. */
const unpacked = () => {
  parts.module ??= (async () => {
    const packed = Uint8Array.from(atob(parts.text("wasm").trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return WebAssembly.compile(await new Response(stream).arrayBuffer());
  })();
  return parts.module;
};

/** One worker; it does one thing after the other. */
class Hand {
  /** @param {(text: string) => void} told Told what goes on. */
  constructor(told) {
    parts.worker ??= URL.createObjectURL(new Blob([parts.text("worker")], { type: "text/javascript" }));
    /** @type {Map<number, Waiting>} */
    this.waiting = new Map();
    this.calls = 0;
    this.isEnded = false;
    /** Which files it has read, in which edition. @type {Map<string, number>} */
    this.has = new Map();
    this.worker = new Worker(parts.worker);
    this.worker.onmessage = ({ data }) => {
      if (data.progress !== undefined) return told(data.progress);
      const one = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      if (one) data.error === undefined ? one.resolve(data.value) : one.reject(new Error(data.error));
      if (data.isDead) this.end(new Error(data.error));
    };
    this.worker.onerror = (event) => this.end(new Error(event.message || "a worker could not be started"));
    this.ready = unpacked().then((module) => this.ask("begin", module));
    // whoever asks for something is told
    this.ready.catch(() => {});
  }

  /** @param {string} method @param {any[]} args @returns {Promise<any>} */
  async call(method, ...args) {
    await this.ready;
    return this.ask(method, ...args);
  }

  /** @param {string} method @param {any[]} args @returns {Promise<any>} */
  ask(method, ...args) {
    if (this.isEnded) return Promise.reject(new Cancelled("cancelled"));
    this.calls += 1;
    const id = this.calls;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ id, method, args });
    });
  }

  /** @param {Error} [why] Ends at once, whatever it does. */
  end(why = new Cancelled("cancelled")) {
    this.isEnded = true;
    this.worker.terminate();
    for (const one of this.waiting.values()) one.reject(why);
    this.waiting.clear();
  }
}
