/*
 * What all parts of the page share: the files, who works, and what is told.
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

/** A number as a table shows it. @param {number|null|undefined} x @param {number} [digits] */
const shown = (x, digits = 4) =>
  x === null || x === undefined || !Number.isFinite(x) ? "–" : String(Number(x.toPrecision(digits))).replace("-", "−");

const state = {
  /** Files as they were dropped, by name. @type {Map<string, File>} */
  files: new Map(),
  /** Those that are read, in the order in which they came. @type {Map<string, About>} */
  recordings: new Map(),
  /** Names of those that are only tested on. @type {Set<string>} */
  held: new Set(),
  /** How they are read, and how often that changed. */
  asked: {},
  edition: 0,
  /** The record that the live view uses, as JSON. */
  record: "",
  /** The calibration file that was dropped last. @type {RecordAbout|null} */
  dropped: null,
};

/** Those who work: the first holds the calibration, the last the diagnosis, those between judge models. */
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

  /** A hand that has read every file. @param {number} i */
  async stocked(i) {
    const hand = crew.hand(i);
    // what says of the others how they belong together comes first
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

  /** Ends those who are at work; what others hold stays. */
  cancel() {
    [CALIBRATOR, DIAGNOSER].filter((i) => crew.hands[i]?.waiting.size).forEach((i) => crew.hands[i].end());
    crew.dismiss();
  },

  /** Ends those who judge models. */
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

  /** Says it to those who do not see the page. @param {string} text */
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

  /** Does something that takes its time; one thing at once. @param {string} what @param {() => Promise<void>} work */
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
      // what was being done is not said to the end of time
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

/** The report that is open. */
const report = {
  /** The results that it is about. */
  of: "",
  name: "",
  text: "",
  /** What had the focus before. @type {Element|null} */
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

  /** Makes the frame as long as what is in it, at every width: a phone has one thing to scroll. */
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
