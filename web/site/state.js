/*
 * State and functions that all parts of the page share: the files, the workers, and messages to the user.
 */

/** @typedef {{name: string, unit: string, least: number, greatest: number}} Column */
/** @typedef {{kind: "recording", name: string, rows: number, seconds: number, rate_hz: number|null, columns: Column[], notes: string[]}} About */
/** @typedef {{kind: "record", name: string, signal: string, reference: string, rate_hz: number}} RecordAbout */

/** @typedef {{head: string[], rows: string[][], best?: number|null}} Shown */

/** @template {Element} T @param {string} id @param {{new(): T}} kind @returns {T} */
const part = (id, kind) => {
  const element = document.getElementById(id);
  if (!(element instanceof kind)) throw new Error(`the page has no part ${id}`);
  return element;
};
const html = (/** @type {string} */ id) => part(id, HTMLElement);
const button = (/** @type {string} */ id) => part(id, HTMLButtonElement);
const select = (/** @type {string} */ id) => part(id, HTMLSelectElement);
const input = (/** @type {string} */ id) => part(id, HTMLInputElement);

/** Formats a number for a table. @param {number|null|undefined} x @param {number} [digits] */
const shown = (x, digits = 4) =>
  x === null || x === undefined || !Number.isFinite(x) ? "–" : String(Number(x.toPrecision(digits))).replace("-", "−");

const state = {
  /** Dropped files by name. @type {Map<string, File>} */
  files: new Map(),
  /** Recordings that were read, by name, in the order of their arrival. @type {Map<string, About>} */
  recordings: new Map(),
  /** Names of the recordings that are used only for testing. @type {Set<string>} */
  held: new Set(),
  /** Reading options, and how often they were changed. */
  asked: {},
  edition: 0,
  /** Calibration file that the live view uses, as JSON. */
  record: "",
  /** The calibration file that was dropped last. @type {RecordAbout|null} */
  dropped: null,
};

/** Indices of the workers: the first makes the calibration, the last the diagnosis. Those between evaluate models. */
const CALIBRATOR = 0;
const DIAGNOSER = 8;
const crew = {
  /** @type {Hand[]} */
  hands: [],
  isBusy: false,
  /** @type {number|undefined} */
  clock: undefined,

  /** @param {number} i @returns {Hand} */
  hand(i) {
    const own = crew.hands[i];
    if (own && !own.isEnded) return own;
    return (crew.hands[i] = new Hand((text) => tell.doing(text)));
  },

  /** Returns a worker that has read all files. @param {number} i */
  async stocked(i) {
    const hand = crew.hand(i);
    // dataset.toml and other TOML files come first, because they describe how the recordings belong together
    const isFirst = (/** @type {string} */ name) => (name === "dataset.toml" ? 0 : name.endsWith(".toml") ? 1 : 2);
    const names = [...state.files.keys()].sort((a, b) => isFirst(a) - isFirst(b));
    for (const name of names) {
      const file = state.files.get(name);
      if (!file || hand.has.get(name) === state.edition) continue;
      if (i === CALIBRATOR || i === DIAGNOSER) tell.doing(`reading ${name}`);
      await crew.read(hand, name, file);
    }
    await hand.call("hold", JSON.stringify([...state.held]));
    return hand;
  },

  /** @param {Hand} hand @param {string} name @param {File} file @param {string[]} [require] @returns {Promise<any>} */
  async read(hand, name, file, require = []) {
    const about = JSON.parse(await hand.call("read", file, name, JSON.stringify({ ...state.asked, require })));
    hand.has.set(name, state.edition);
    return about;
  },

  /** Ends the workers that are busy. The results of the others are kept. */
  cancel() {
    [CALIBRATOR, DIAGNOSER].filter((i) => crew.hands[i]?.waiting.size).forEach((i) => crew.hands[i].end());
    crew.dismiss();
  },

  /** Ends the workers that evaluate models. */
  dismiss() {
    crew.hands.slice(CALIBRATOR + 1, DIAGNOSER).forEach((hand) => hand.end());
  },

  end() {
    crew.hands.forEach((hand) => hand.end());
    crew.hands = [];
  },
};

const tell = {
  /** @param {string} text */
  doing(text) {
    html("doing").dataset.text = text;
    html("doing").textContent = text;
    tell.announce(text);
  },

  /** Announces a text to users of a screen reader. @param {string} text */
  announce(text) {
    html("announced").textContent = text;
  },

  cancelled() {
    html("cancelled").textContent = `Cancelled: ${html("doing").dataset.text}.`;
    html("cancelled").hidden = false;
    tell.announce("Cancelled.");
  },

  /** @param {unknown} error */
  wrong(error) {
    html("wrong").hidden = error === "";
    html("wrong").textContent = error instanceof Error ? error.message : String(error);
    if (error !== "") html("wrong").scrollIntoView({ block: "nearest" });
  },

  /** Runs a long calculation and shows its progress. Only one runs at a time. @param {string} what @param {() => Promise<void>} work */
  async busy(what, work) {
    if (crew.isBusy) {
      tell.wrong("A calculation is running: wait for it, or cancel it.");
      return;
    }
    crew.isBusy = true;
    tell.wrong("");
    html("cancelled").hidden = true;
    tell.doing(what);
    html("busy").hidden = false;
    document.body.dataset.busy = "1";
    const begun = performance.now();
    crew.clock = window.setInterval(() => {
      const seconds = Math.round((performance.now() - begun) / 1000);
      html("doing").textContent = `${html("doing").dataset.text}, ${seconds} s`;
    }, 1000);
    try {
      await work();
      // replace the last progress message, if it is still shown
      if (html("announced").textContent === html("doing").dataset.text) tell.announce("Done.");
    } catch (error) {
      if (error instanceof Cancelled) tell.cancelled();
      else tell.wrong(error), tell.announce("");
    } finally {
      window.clearInterval(crew.clock);
      html("busy").hidden = true;
      crew.isBusy = false;
      delete document.body.dataset.busy;
    }
  },

  /** @param {string} name @param {string} text @param {string} [type] */
  save(name, text, type = "text/plain") {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    window.setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  },

  /** @param {string} id @param {string[]} sentences */
  list(id, sentences) {
    html(id).replaceChildren(...sentences.map((sentence) => {
      const item = document.createElement("li");
      item.textContent = sentence;
      return item;
    }));
  },

  /** @param {string} id @param {Shown} table The first cell of a row is its name. */
  table(id, { head: heads, rows, best }) {
    const line = document.createElement("tr");
    line.append(...heads.map((text) => {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.textContent = text;
      return cell;
    }));
    html(id).closest("table")?.tHead?.replaceChildren(line);
    html(id).replaceChildren(...rows.map((cells, i) => {
      const row = document.createElement("tr");
      if (i === best) row.className = "best";
      row.append(...cells.map((text, k) => {
        const cell = document.createElement(k ? "td" : "th");
        if (!k) cell.setAttribute("scope", "row");
        else cell.dataset.head = heads[k];
        if (text.length > 24) cell.className = "words";
        cell.textContent = text;
        return cell;
      }));
      return row;
    }));
  },
};

/** The open report. */
const report = {
  /** Id of the results that the report shows. */
  of: "",
  name: "",
  text: "",
  /** Element that had the focus before the report was opened. @type {Element|null} */
  opener: null,

  /** @param {string} of @param {string} name @param {string} title @param {string} text */
  open(of, name, title, text) {
    Object.assign(report, { of, name, text, opener: document.activeElement });
    const frame = part("page", HTMLIFrameElement);
    frame.onload = report.fit;
    frame.srcdoc = text;
    frame.title = html("report-name").textContent = `Report: ${title}`;
    html("report").hidden = false;
    html("report").scrollIntoView();
    html("report-name").focus({ preventScroll: true });
  },

  /** Sets the height of the frame to that of its content, so that only the page scrolls. */
  fit() {
    const frame = part("page", HTMLIFrameElement);
    const inside = frame.contentDocument?.documentElement;
    if (!inside || html("report").hidden) return;
    frame.style.height = "0";
    frame.style.height = `${inside.scrollHeight + 4}px`;
  },

  close() {
    const hasFocus = html("report").contains(document.activeElement);
    part("page", HTMLIFrameElement).srcdoc = "";
    html("report").hidden = true;
    report.of = "";
    if (hasFocus && report.opener instanceof HTMLElement) report.opener.focus();
  },
};
