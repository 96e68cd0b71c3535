/*
 * Workers, each with the compiled crates of stretch. They are created from the text of the page, because a page that was
 * opened from a disk cannot load other files.
 */

/** @typedef {{resolve: (value: any) => void, reject: (why: Error) => void}} Waiting */

/** Error of a call that was cancelled. */
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

/** Returns the compiled crates, which are unpacked once. */
const unpacked = () => {
  parts.module ??= (async () => {
    const packed = Uint8Array.from(atob(parts.text("wasm").trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return WebAssembly.compile(await new Response(stream).arrayBuffer());
  })();
  return parts.module;
};

/** One worker. It processes its calls one after the other. */
class Hand {
  /** @param {(text: string) => void} told Called with progress messages. */
  constructor(told) {
    parts.worker ??= URL.createObjectURL(new Blob([parts.text("worker")], { type: "text/javascript" }));
    /** @type {Map<number, Waiting>} */
    this.waiting = new Map();
    this.calls = 0;
    this.isEnded = false;
    /** Files that it has read, each with the edition of the reading options. @type {Map<string, number>} */
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
    // every call awaits `ready` and reports the error
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

  /** @param {Error} [why] Ends the worker at once, also during a call. */
  end(why = new Cancelled("cancelled")) {
    this.isEnded = true;
    this.worker.terminate();
    for (const one of this.waiting.values()) one.reject(why);
    this.waiting.clear();
  }
}
