/*
 * Makes the figures of a report interactive. Time plots zoom and pan together, bars and scatter plots highlight their
 * samples in the time plots, and surfaces can be rotated. Without this script the figures are static drawings.
 * The data come from the JSON in each figure; nothing is fetched.
 */
(() => {
  "use strict";

  /** @typedef {{t: number, dt: number, o: number, q: number, d: (number|null)[]}} Packed */
  /** @typedef {{t: number, dt: number, y: Float64Array}} Level */
  /** @typedef {{name: string, ink: string, w: number, levels: Packed[]}} PackedSeries */
  /** @typedef {{name: string, ink: string, w: number, levels: Level[]}} Series */
  /** @typedef {{by: string, from: number, to: number, size?: boolean}} Pick */
  /** @typedef {{kind: "time", link: string, x: string, y: string, unit: string, height: number, span: number[], view: number[], all?: boolean, series: PackedSeries[], keys?: Record<string, Packed[]>, moves: "out"|"left"|null}} TimeData */
  /** @typedef {{label: string, top: number, bottom: number, text: string, pick?: Pick}} BarRow */
  /** @typedef {{kind: "bars", link: string, rows: BarRow[]}} BarsData */
  /** @typedef {{top: number, bottom: number, left: number, right: number, y: number[], name: string}} Panel */
  /** @typedef {{kind: "scatter", link: string, x: number[], xname: string, xunit: string, yunit: string, by?: string, panels: Panel[]}} ScatterData */
  /** @typedef {{name: string, unit: string, at: number, values: number[], out: Packed[][], left: Packed[][], x: number[], panel: Panel}} Turned */
  /** @typedef {{kind: "turn", link: string, ink: string, unit: string, noise: number, products: number[][], parameters: Turned[]}} TurnData */
  /** @typedef {{name: string, unit: string, span: number[]}} Axis */
  /** @typedef {{kind: "surface", axes: Axis[], ink: string, cells: number, z: (number|null)[], on: string, points: number[]}} SurfaceData */
  /** @typedef {{window: number[], pick: Pick|null, cursor: number|null, series: Series[], keys: Map<string, Level[]>, moving: {by: "out"|"left", series: Series[]}[], plots: {draw: () => void, point: () => void}[]}} Link */

  const MARGIN = { left: 58, right: 14, top: 26, bottom: 40 };
  const still = document.querySelector("figure svg");
  if (!still) return;
  const NS = still.namespaceURI;

  /**
   * @param {string} name
   * @param {Record<string, string|number>} [attributes]
   * @param {Element} [parent]
   * @returns {SVGElement}
   */
  const svg = (name, attributes = {}, parent) => {
    const element = /** @type {SVGElement} */ (document.createElementNS(NS, name));
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
    if (parent) parent.append(element);
    return element;
  };

  /**
   * @param {Element} parent
   * @param {number} x
   * @param {number} y
   * @param {string} words
   * @param {string} anchor
   */
  const text = (parent, x, y, words, anchor) => {
    const element = svg("text", { class: "ink-text", x, y, "text-anchor": anchor, "font-size": 14 }, parent);
    element.textContent = words;
  };

  /** @param {number} x @param {number} span Formats a number with enough decimals for a thousandth of a span. */
  const number = (x, span) => {
    if (!Number.isFinite(x)) return "\u2013";
    const decimals = Math.min(Math.max(Math.ceil(3 - Math.log10(Math.abs(span) || 1)), 0), 9);
    return x.toFixed(decimals).replace(/^-0(\.0*)?$/, "0$1").replace("-", "\u2212");
  };

  /** @param {string} value @param {string} unit */
  const withUnit = (value, unit) => (unit ? `${value}\u00a0${unit}` : value);

  /** @param {number} low @param {number} high @param {number} most Returns round numbers in a span. */
  const ticks = (low, high, most) => {
    const rough = (high - low) / Math.max(most, 1);
    if (!(rough > 0) || !Number.isFinite(rough)) return { values: [], decimals: 0 };
    const ten = 10 ** Math.floor(Math.log10(rough));
    const step = ([1, 2, 5, 10].find((m) => m * ten >= rough * 0.999) || 10) * ten;
    const values = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) values.push(k * step);
    return { values, decimals: Math.min(Math.max(-Math.floor(Math.log10(step) + 1e-9), 0), 9) };
  };

  /** @param {number} x @param {number} decimals */
  const tick = (x, decimals) => x.toFixed(decimals).replace(/^-(0(\.0*)?)$/, "$1").replace("-", "\u2212");

  /** @param {Packed} packed @returns {Level} */
  const unpacked = ({ t, dt, o, q, d }) => {
    const y = new Float64Array(d.length);
    let sum = 0;
    d.forEach((step, i) => {
      if (step === null) y[i] = NaN;
      else y[i] = o + q * (sum += step);
    });
    return { t, dt, y };
  };

  /** @param {Level[]} levels @param {number[]} window Returns the finest level that covers a window. */
  const fitting = (levels, [from, to]) => {
    const covers = (/** @type {Level} */ { t, dt, y }) => t <= from + dt && t + dt * y.length >= to - dt;
    return levels.filter(covers).reduce((a, b) => (b.dt < a.dt ? b : a), levels[0]);
  };

  /** @type {Map<string, Link>} */
  const links = new Map();
  /** @param {string} name @param {number[]} window */
  const linked = (name, window) => {
    const found = links.get(name);
    if (found) return found;
    /** @type {Link} */
    const link = { window: [...window], pick: null, cursor: null, series: [], keys: new Map(), moving: [], plots: [] };
    links.set(name, link);
    return link;
  };
  /** @param {Link} link */
  const redraw = (link) => link.plots.forEach((plot) => plot.draw());

  const tip = document.createElement("div");
  tip.className = "tip";
  tip.hidden = true;
  tip.setAttribute("role", "status");
  document.body.append(tip);

  /** @param {string[]} lines @param {number} x @param {number} y */
  const show = (lines, x, y) => {
    tip.replaceChildren(...lines.map((line) => {
      const row = document.createElement("div");
      row.textContent = line;
      return row;
    }));
    tip.hidden = false;
    const { width, height } = tip.getBoundingClientRect();
    const most = document.documentElement.clientWidth - width - 6;
    tip.style.left = `${Math.max(6, Math.min(x + 14, most))}px`;
    tip.style.top = `${y - height - 12 < 4 ? y + 18 : y - height - 12}px`;
  };
  const hide = () => { tip.hidden = true; };

  /**
   * Replaces the static drawings by an interactive one.
   * @param {HTMLElement} figure
   * @param {string} hint
   * @param {string} keys
   */
  const stage = (figure, hint, keys) => {
    const old = figure.querySelectorAll("svg");
    const label = (old[0] && old[0].getAttribute("aria-label")) || "";
    const box = svg("svg", { class: "live", tabindex: 0, role: "application", "aria-label": `${label}. ${keys}` });
    if (old[0]) old[0].before(box);
    old.forEach((drawing) => drawing.remove());
    const words = document.createElement("p");
    words.className = "hint";
    words.textContent = hint;
    box.after(words);
    return /** @type {SVGSVGElement} */ (/** @type {unknown} */ (box));
  };

  /**
   * Makes the entries of a legend switches, which hide and show the shapes of their colour.
   * @param {HTMLElement} figure
   * @param {() => void} after
   * @returns {Set<string>}
   */
  const switches = (figure, after) => {
    /** @type {Set<string>} */
    const off = new Set();
    figure.querySelectorAll(".legend span").forEach((entry) => {
      const ink = entry.querySelector("i");
      if (!ink) return;
      const button = document.createElement("button");
      button.type = "button";
      button.setAttribute("aria-pressed", "true");
      button.append(...entry.childNodes);
      entry.replaceWith(button);
      button.addEventListener("click", () => {
        const gone = off.has(ink.className);
        if (gone) off.delete(ink.className);
        else off.add(ink.className);
        button.setAttribute("aria-pressed", String(gone));
        after();
      });
    });
    return off;
  };

  /**
   * Handles gestures: dragging with one pointer, pinching with two.
   * @param {SVGSVGElement} box
   * @param {(dx: number, dy: number) => void} drag
   * @param {(factor: number, x: number) => void} pinch
   */
  const gestures = (box, drag, pinch) => {
    /** @type {Map<number, PointerEvent>} */
    const down = new Map();
    box.addEventListener("pointerdown", (event) => {
      down.set(event.pointerId, event);
      box.setPointerCapture(event.pointerId);
      box.focus({ preventScroll: true });
    });
    const end = (/** @type {PointerEvent} */ event) => { down.delete(event.pointerId); };
    box.addEventListener("pointerup", end);
    box.addEventListener("pointercancel", end);
    box.addEventListener("pointermove", (event) => {
      const last = down.get(event.pointerId);
      if (!last) return;
      const others = [...down.values()].filter((p) => p.pointerId !== event.pointerId);
      if (others.length === 0) drag(event.clientX - last.clientX, event.clientY - last.clientY);
      else {
        const far = (/** @type {PointerEvent} */ p) => Math.hypot(p.clientX - others[0].clientX, p.clientY - others[0].clientY);
        const middle = (event.clientX + others[0].clientX) / 2;
        if (far(last) > 4) pinch(far(last) / Math.max(far(event), 4), middle);
      }
      down.set(event.pointerId, event);
    });
    return down;
  };

  /** @param {HTMLElement} figure @param {TimeData} data */
  const time = (figure, data) => {
    const link = linked(data.link, data.view);
    const own = data.series.map((s) => ({ ...s, levels: s.levels.map(unpacked) }));
    // a plot of the whole recording without data draws the curves of the linked plot
    const series = own.length > 0 ? own : link.series;
    link.series = series;
    if (data.moves) link.moving.push({ by: data.moves, series: own });
    const { keys } = link;
    for (const [key, levels] of Object.entries(data.keys || {})) keys.set(key, levels.map(unpacked));
    const box = stage(figure,
      "Drag to move, click and turn the wheel or pinch to zoom, tap a name to switch its line off.",
      "Arrow keys move, plus and minus zoom, 0 shows it as it was.");
    const off = switches(figure, () => draw());
    // a plot of the whole recording marks the window of the linked plots by a frame
    const seen = () => (data.all ? data.span : link.window);
    let [width, height] = [880, data.height];
    let y = [0, 1];

    const place = (/** @type {number} */ t) => {
      const [from, to] = seen();
      return MARGIN.left + ((t - from) / (to - from)) * (width - MARGIN.left - MARGIN.right);
    };
    const instant = (/** @type {number} */ x) => {
      const [from, to] = seen();
      return from + ((x - MARGIN.left) / (width - MARGIN.left - MARGIN.right)) * (to - from);
    };
    const rise = (/** @type {number} */ v) =>
      height - MARGIN.bottom - ((v - y[0]) / (y[1] - y[0])) * (height - MARGIN.bottom - MARGIN.top);

    /** @param {Level} level */
    const within = ({ t, dt, y: all }) => {
      const [from, to] = seen();
      return [Math.max(0, Math.floor((from - t) / dt)), Math.min(all.length - 1, Math.ceil((to - t) / dt))];
    };

    const scale = () => {
      let [low, high] = [Infinity, -Infinity];
      for (const one of series.filter((s) => !off.has(s.ink))) {
        const level = fitting(one.levels, seen());
        const [first, last] = within(level);
        for (let i = first; i <= last; i += 1) {
          const value = level.y[i];
          if (value < low) low = value;
          if (value > high) high = value;
        }
      }
      if (!(low <= high)) return;
      const pad = 0.06 * (high - low) || 0.5;
      y = [low - pad, high + pad];
    };

    /** @param {Pick} pick Returns the time intervals of the selected samples. */
    const picked = (pick) => {
      const [from, to] = seen();
      if (pick.by === "time") return [[Math.max(pick.from, from), Math.min(pick.to, to)]].filter(([a, b]) => b > a);
      const levels = keys.get(pick.by);
      if (!levels) return [];
      const level = fitting(levels, seen());
      const [first, last] = within(level);
      /** @type {number[][]} */
      const found = [];
      let begin = NaN;
      for (let i = first; i <= last + 1; i += 1) {
        const value = pick.size ? Math.abs(level.y[i]) : level.y[i];
        const inside = i <= last && value >= pick.from && value <= pick.to;
        const t = level.t + i * level.dt;
        if (inside && Number.isNaN(begin)) begin = t;
        if (!inside && !Number.isNaN(begin)) {
          found.push([Math.max(begin, from), Math.min(t, to)]);
          begin = NaN;
        }
      }
      return found;
    };

    const frame = () => {
      const [from, to] = seen();
      const wide = width - MARGIN.right;
      const low = height - MARGIN.bottom;
      const across = ticks(from, to, Math.floor(width / 90));
      for (const t of across.values) {
        svg("path", { class: "line ink-grid", d: `M${place(t)} ${MARGIN.top}V${low}` }, box);
        text(box, place(t), low + 17, tick(t, across.decimals), "middle");
      }
      const up = ticks(y[0], y[1], Math.floor(height / 34));
      for (const v of up.values) {
        svg("path", { class: "line ink-grid", d: `M${MARGIN.left} ${rise(v)}H${wide}` }, box);
        text(box, MARGIN.left - 6, rise(v) + 5, tick(v, up.decimals), "end");
      }
      svg("path", { class: "line ink-axis", d: `M${MARGIN.left} ${MARGIN.top}V${low}H${wide}` }, box);
      text(box, 4, 15, data.y, "start");
      text(box, wide, height - 4, data.x, "end");
    };

    /** @param {Series} one @param {Element} inside */
    const curve = (one, inside) => {
      const level = fitting(one.levels, seen());
      const [first, last] = within(level);
      let d = "";
      let pen = false;
      for (let i = first; i <= last; i += 1) {
        const value = level.y[i];
        if (Number.isNaN(value)) { pen = false; continue; }
        d += `${pen ? "L" : "M"}${place(level.t + i * level.dt).toFixed(1)} ${rise(value).toFixed(1)}`;
        pen = true;
      }
      svg("path", { class: `line ${one.ink}`, "stroke-width": one.w, d }, inside);
    };

    const cursor = svg("path", { class: "line ink-axis cursor" });
    const clip = `clip-${Math.random().toString(36).slice(2)}`;
    const draw = () => {
      width = Math.max(box.clientWidth, 280);
      height = width < 600 ? Math.min(data.height, 290) : data.height;
      box.setAttribute("viewBox", `0 0 ${width} ${height}`);
      box.replaceChildren();
      const inner = { x: MARGIN.left, y: MARGIN.top, width: width - MARGIN.left - MARGIN.right, height: height - MARGIN.top - MARGIN.bottom };
      svg("rect", inner, svg("clipPath", { id: clip }, box));
      scale();
      if (link.pick) {
        for (const [a, b] of picked(link.pick)) {
          const size = { x: place(a), y: MARGIN.top, width: Math.max(place(b) - place(a), 0.8), height: inner.height };
          svg("rect", { class: "picked", ...size }, box);
        }
      }
      frame();
      const lines = svg("g", { "clip-path": `url(#${clip})` }, box);
      series.filter((s) => !off.has(s.ink)).forEach((one) => curve(one, lines));
      if (data.all) {
        const [a, b] = link.window.map(place);
        svg("rect", { class: "window", x: a, y: MARGIN.top, width: Math.max(b - a, 2), height: inner.height }, box);
      }
      box.append(cursor);
      box.dataset.from = String(seen()[0]);
      box.dataset.to = String(seen()[1]);
      point();
    };

    const point = () => {
      const at = link.cursor;
      const inside = at !== null && at >= seen()[0] && at <= seen()[1];
      cursor.setAttribute("d", inside && at !== null ? `M${place(at)} ${MARGIN.top}V${height - MARGIN.bottom}` : "M0 0");
    };

    /** @param {number} factor @param {number} about */
    const zoom = (factor, about) => {
      const [from, to] = link.window;
      const whole = data.span[1] - data.span[0];
      const finest = Math.min(...series.flatMap((s) => s.levels.map((l) => l.dt)));
      const size = Math.min(Math.max((to - from) * factor, 20 * finest), whole);
      const share = (about - from) / (to - from);
      shift(about - share * size, size);
    };
    /** @param {number} from @param {number} size */
    const shift = (from, size) => {
      const begin = Math.max(data.span[0], Math.min(from, data.span[1] - size));
      link.window = [begin, begin + size];
      redraw(link);
    };
    const pan = (/** @type {number} */ by) => shift(link.window[0] + by, link.window[1] - link.window[0]);
    const home = () => { link.window = [...data.view]; link.pick = null; redraw(link); };
    const where = (/** @type {number} */ clientX) => instant(clientX - box.getBoundingClientRect().left);

    const down = gestures(box, (dx) => {
      const [from, to] = seen();
      const by = (dx / (width - MARGIN.left - MARGIN.right)) * (to - from);
      pan(data.all ? by : -by);
    }, (factor, x) => zoom(factor, where(x)));
    box.addEventListener("wheel", (event) => {
      // the wheel scrolls the page unless the plot has the focus
      if (!(event.ctrlKey || document.activeElement === box)) return;
      event.preventDefault();
      zoom(Math.exp(Math.max(-0.5, Math.min(event.deltaY * 0.002, 0.5))), where(event.clientX));
    }, { passive: false });
    box.addEventListener("dblclick", home);
    box.addEventListener("keydown", (event) => {
      const size = link.window[1] - link.window[0];
      const middle = (link.window[0] + link.window[1]) / 2;
      /** @type {Record<string, () => void>} */
      const does = {
        ArrowLeft: () => pan(-0.1 * size), ArrowRight: () => pan(0.1 * size),
        ArrowUp: () => zoom(0.8, middle), ArrowDown: () => zoom(1.25, middle),
        "+": () => zoom(0.8, middle), "=": () => zoom(0.8, middle), "-": () => zoom(1.25, middle), 0: home,
      };
      const act = event.ctrlKey || event.metaKey ? undefined : does[event.key];
      if (act) { event.preventDefault(); act(); }
    });
    box.addEventListener("pointermove", (event) => {
      if (down.size > 1) return hide();
      const at = where(event.clientX);
      if (at < seen()[0] || at > seen()[1]) return leave();
      link.cursor = at;
      link.plots.forEach((plot) => plot.point());
      const lines = series.filter((s) => !off.has(s.ink)).map((one) => {
        const level = fitting(one.levels, seen());
        const value = level.y[Math.round((at - level.t) / level.dt)];
        return `${one.name}: ${withUnit(number(value, y[1] - y[0]), data.unit)}`;
      });
      show([withUnit(number(at, seen()[1] - seen()[0]), "s"), ...lines], event.clientX, event.clientY);
      return undefined;
    });
    const leave = () => { link.cursor = null; link.plots.forEach((plot) => plot.point()); hide(); };
    box.addEventListener("pointerleave", leave);
    link.plots.push({ draw, point });
    new ResizeObserver(() => { if (box.clientWidth && Math.abs(box.clientWidth - width) > 1) draw(); }).observe(box);
    draw();
  };

  /** @param {string} name @param {Pick|null} pick */
  const pickIn = (name, pick) => {
    const link = links.get(name);
    if (!link) return;
    link.pick = pick;
    redraw(link);
  };

  /** @param {HTMLElement} figure @param {BarsData} data */
  const bars = (figure, data) => {
    /** @type {SVGElement[]} */
    const hits = [];
    figure.querySelectorAll("svg").forEach((drawing) => {
      const width = drawing.viewBox.baseVal.width;
      for (const row of data.rows) {
        const hit = svg("rect", { class: "hit", x: 0, y: row.top, width, height: row.bottom - row.top }, drawing);
        const said = `${row.label}: ${row.text}`;
        hit.addEventListener("pointermove", (event) => show([said], event.clientX, event.clientY));
        hit.addEventListener("pointerleave", hide);
        const pick = row.pick;
        if (!pick) continue;
        hits.push(hit);
        drawing.setAttribute("role", "group");
        hit.setAttribute("tabindex", "0");
        hit.setAttribute("role", "button");
        hit.setAttribute("aria-pressed", "false");
        hit.setAttribute("aria-label", `${said}. Show its samples over time`);
        const choose = () => {
          const on = hit.getAttribute("aria-pressed") !== "true";
          document.querySelectorAll(".hit[aria-pressed=true]").forEach((h) => h.setAttribute("aria-pressed", "false"));
          hit.setAttribute("aria-pressed", String(on));
          pickIn(data.link, on ? pick : null);
        };
        hit.addEventListener("click", choose);
        hit.addEventListener("keydown", (event) => {
          if (event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(); }
        });
      }
    });
    if (hits.length > 0 && links.has(data.link)) {
      const words = document.createElement("p");
      words.className = "hint";
      words.textContent = "Tap a bar to mark its samples in the plots over time.";
      figure.append(words);
    }
    hidden(figure);
  };

  /** @param {HTMLElement} figure @param {ScatterData} data */
  const scatter = (figure, data) => {
    const drawing = figure.querySelector("svg");
    if (!drawing) return;
    for (const panel of data.panels) {
      const [low, high] = data.x;
      const size = { x: panel.left, y: panel.top, width: panel.right - panel.left, height: panel.bottom - panel.top };
      const brush = svg("rect", { class: "picked", ...size, width: 0 }, drawing);
      const hit = svg("rect", { class: "hit", ...size }, drawing);
      const at = (/** @type {PointerEvent} */ event) => {
        const rect = hit.getBoundingClientRect();
        const share = Math.max(0, Math.min((event.clientX - rect.left) / rect.width, 1));
        const up = (rect.bottom - event.clientY) / rect.height;
        return [low + share * (high - low), panel.y[0] + up * (panel.y[1] - panel.y[0])];
      };
      let begin = NaN;
      hit.addEventListener("pointermove", (event) => {
        const [x, y] = at(event);
        show([`${data.xname}: ${withUnit(number(x, high - low), data.xunit)}`,
          `${panel.name}: ${withUnit(number(y, panel.y[1] - panel.y[0]), data.yunit)}`], event.clientX, event.clientY);
        if (Number.isNaN(begin) || !data.by) return;
        const [from, to] = [Math.min(begin, x), Math.max(begin, x)];
        const across = (/** @type {number} */ v) => size.x + ((v - low) / (high - low)) * size.width;
        brush.setAttribute("x", String(across(from)));
        brush.setAttribute("width", String(across(to) - across(from)));
        pickIn(data.link, to > from ? { by: data.by, from, to } : null);
      });
      hit.addEventListener("pointerleave", hide);
      if (!data.by || !links.has(data.link)) continue;
      hit.addEventListener("pointerdown", (event) => {
        begin = at(event)[0];
        brush.setAttribute("width", "0");
        hit.setPointerCapture(event.pointerId);
        pickIn(data.link, null);
      });
      const end = () => { begin = NaN; };
      hit.addEventListener("pointerup", end);
      hit.addEventListener("pointercancel", end);
    }
    if (data.by && links.has(data.link)) {
      const words = document.createElement("p");
      words.className = "hint";
      words.textContent = "Drag across to mark these samples in the plots over time.";
      figure.append(words);
    }
  };

  /** @param {HTMLElement} figure */
  const surface = (figure, /** @type {SurfaceData} */ data) => {
    const legend = figure.querySelector(".legend");
    if (legend) {
      const [entry, swatch] = [document.createElement("span"), document.createElement("i")];
      swatch.className = "ink-2";
      entry.append(swatch, "distance to the surface");
      legend.append(entry);
    }
    const box = stage(figure, "Drag to turn it; hover or tap a sample for its numbers.", "Arrow keys turn it, 0 shows it as it was.");
    const off = switches(figure, () => draw());
    const START = [0.62, 0.5];
    let [yaw, pitch] = START;
    let [width, height] = [400, 340];
    const n = data.cells;
    /** @type {{at: number[], up: number, over: number}[]} */
    const points = [];
    for (let i = 0; i + 3 < data.points.length; i += 4) {
      const [u, r, z, over] = data.points.slice(i, i + 4).map((v) => v / 1000);
      points.push({ at: [u, r, z], up: z - over, over });
    }
    /** @type {{x: number, y: number, lines: string[]}[]} */
    let shown = [];

    /** @param {number[]} p Returns the position of a point of the unit cube on the page, and its depth. */
    const eye = ([u, r, z]) => {
      const [a, b] = [u - 0.5, r - 0.5];
      const across = Math.cos(yaw) * a - Math.sin(yaw) * b;
      const behind = Math.sin(yaw) * a + Math.cos(yaw) * b;
      const size = Math.min((width - 130) / 1.42, (height - 92) / (Math.cos(pitch) + 1.42 * Math.sin(pitch)));
      const up = Math.cos(pitch) * (z - 0.5) + Math.sin(pitch) * behind;
      return [width / 2 + 22 + size * across * ((width - 130) / 1.42 / size), height / 2 - 2 - size * up, behind];
    };
    /** @param {number[]} a @param {number[]} b @param {string} style @param {number} [w] */
    const line = (a, b, style, w = 1) => {
      const [p, q] = [eye(a), eye(b)];
      svg("path", { class: `line ${style}`, "stroke-width": w, d: `M${p[0]} ${p[1]}L${q[0]} ${q[1]}` }, box);
    };
    /** @param {Axis} axis @param {(v: number) => number[]} at @param {number} dx @param {string} anchor */
    const numbers = ({ span }, at, dx, anchor) => {
      const [low, high] = [Math.min(...span), Math.max(...span)];
      const { values, decimals } = ticks(low, high, 4);
      for (const value of values) {
        const [x, y] = eye(at((value - span[0]) / (span[1] - span[0])));
        text(box, x + dx, y + (anchor === "end" && dx < -6 ? 4 : 15), tick(value, decimals), anchor);
      }
    };

    const axes = () => {
      const near = (/** @type {number[]} */ a, /** @type {number[]} */ b) => (eye(a)[2] < eye(b)[2]);
      const r = near([0.5, 0, 0], [0.5, 1, 0]) ? 0 : 1;
      const u = near([0, 0.5, 0], [1, 0.5, 0]) ? 0 : 1;
      for (let k = 0; k <= 4; k += 1) {
        line([k / 4, 0, 0], [k / 4, 1, 0], "ink-grid");
        line([0, k / 4, 0], [1, k / 4, 0], "ink-grid");
        line([k / 4, 1 - r, 0], [k / 4, 1 - r, 1], "ink-grid");
        line([1 - u, k / 4, 0], [1 - u, k / 4, 1], "ink-grid");
      }
      const side = (/** @type {number[]} */ end) => (eye(end)[0] > eye([0.5, 0.5, 0])[0] ? 1 : -1);
      const su = side([0.5, r, 0]);
      const sr = side([u, 0.5, 0]);
      numbers(data.axes[1], (v) => [v, r, 0], 5 * su, su > 0 ? "start" : "end");
      numbers(data.axes[0], (v) => [u, v, 0], 5 * sr, sr > 0 ? "start" : "end");
      // the leftmost corner has the scale of the height
      const corners = [[0, 0], [0, 1], [1, 0], [1, 1]];
      const left = corners.reduce((a, b) => (eye([...b, 0])[0] < eye([...a, 0])[0] ? b : a));
      line([...left, 0], [...left, 1], "ink-axis");
      numbers(data.axes[2], (v) => [...left, v], -7, "end");
      line([0, r, 0], [1, r, 0], "ink-axis");
      line([u, 0, 0], [u, 1, 0], "ink-axis");
      const name = (/** @type {Axis} */ { name: words, unit }) => (unit ? `${words}, ${unit}` : words);
      text(box, 4, 15, name(data.axes[2]), "start");
      text(box, su > 0 ? width - 4 : 4, height - (su === sr ? 22 : 4), name(data.axes[1]), su > 0 ? "end" : "start");
      text(box, sr > 0 ? width - 4 : 4, height - 4, name(data.axes[0]), sr > 0 ? "end" : "start");
    };

    const mesh = () => {
      const cells = [];
      for (let c = 0; c < n * n; c += 1) {
        const [i, j] = [Math.floor(c / n), c % n];
        const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const heights = corners.map(([a, b]) => data.z[a * (n + 1) + b]);
        if (heights.includes(null)) continue;
        const places = corners.map(([a, b], k) => eye([a / n, b / n, (heights[k] || 0) / 1000]));
        const lit = data.on[c] === "1";
        cells.push({ places, lit, far: places.reduce((s, p) => s + p[2], 0) });
      }
      cells.sort((a, b) => b.far - a.far);
      for (const { places, lit } of cells) {
        const d = `M${places.map((p) => `${p[0].toFixed(1)} ${p[1].toFixed(1)}`).join("L")}z`;
        if (lit) svg("path", { class: `area ${data.ink}`, "fill-opacity": 0.35, d }, box);
        svg("path", { class: `line ${data.ink}`, "stroke-width": 0.5, "stroke-opacity": lit ? 0.8 : 0.3, d }, box);
      }
    };

    /** @param {boolean} above */
    const samples = (above) => {
      let [stems, dots] = ["", ""];
      for (const { at, up, over } of points) {
        if ((over >= 0) !== above) continue;
        const [p, q] = [eye(at), eye([at[0], at[1], up])];
        stems += `M${p[0].toFixed(1)} ${p[1].toFixed(1)}L${q[0].toFixed(1)} ${q[1].toFixed(1)}`;
        dots += `M${p[0].toFixed(1)} ${p[1].toFixed(1)}h0`;
        const units = [...at, over].map((v, k) => {
          const { name, unit, span } = data.axes[[1, 0, 2, 2][k]];
          const size = span[1] - span[0];
          const value = k < 3 ? span[0] + v * size : v * size;
          return `${k < 3 ? name : "above the surface"}: ${withUnit(number(value, size), unit)}`;
        });
        shown.push({ x: p[0], y: p[1], lines: units });
      }
      if (!off.has("ink-2")) svg("path", { class: "line ink-2 stem", "stroke-width": 1, "stroke-opacity": 0.8, d: stems || "M0 0" }, box);
      if (!off.has("ink-truth")) {
        svg("path", { class: "dots ink-truth", "stroke-width": 2.4, "stroke-opacity": above ? 0.75 : 0.45, d: dots || "M0 0" }, box);
      }
    };

    const draw = () => {
      width = Math.max(box.clientWidth, 280);
      height = Math.min(Math.round(0.85 * width), 380);
      box.setAttribute("viewBox", `0 0 ${width} ${height}`);
      box.replaceChildren();
      shown = [];
      axes();
      samples(false);
      if (!off.has(data.ink)) mesh();
      samples(true);
      box.dataset.yaw = yaw.toFixed(3);
    };
    const turn = (/** @type {number} */ dx, /** @type {number} */ dy) => {
      yaw += dx;
      pitch = Math.max(0.05, Math.min(pitch + dy, 1.4));
      draw();
    };
    gestures(box, (dx, dy) => turn(dx * 0.008, dy * 0.006), () => undefined);
    box.addEventListener("keydown", (event) => {
      /** @type {Record<string, number[]>} */
      const does = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] };
      if (event.key === "0") { [yaw, pitch] = START; draw(); }
      const by = does[event.key];
      if (by) { event.preventDefault(); turn(by[0], by[1]); }
    });
    box.addEventListener("pointermove", (event) => {
      const rect = box.getBoundingClientRect();
      const [x, y] = [event.clientX - rect.left, event.clientY - rect.top];
      const best = shown.reduce((/** @type {typeof shown[0]|null} */ a, b) =>
        (!a || Math.hypot(b.x - x, b.y - y) < Math.hypot(a.x - x, a.y - y) ? b : a), null);
      if (best && Math.hypot(best.x - x, best.y - y) < 12) show(best.lines, event.clientX, event.clientY);
      else hide();
    });
    box.addEventListener("pointerleave", hide);
    new ResizeObserver(() => { if (box.clientWidth && Math.abs(box.clientWidth - width) > 1) draw(); }).observe(box);
    draw();
  };

  /**
   * Sliders for the parameters of an effect. Between the simulated values, the output is interpolated linearly.
   * @param {HTMLElement} figure
   * @param {TurnData} data
   */
  const turn = (figure, data) => {
    const drawing = figure.querySelector("svg");
    const link = links.get(data.link);
    if (!drawing || !link) return;
    const moved = link.moving.flatMap(({ by, series }) => series.filter((s) => s.ink === data.ink)
      .flatMap((s) => s.levels.map(({ y }, grid) => ({ by, y, grid, base: y.slice() }))));
    let row = 0;
    const turned = data.parameters.map((one) => {
      const knots = one.values.map((value, k) => {
        row += 1;
        return { value, row, out: one.out[k].map(unpacked), left: one.left[k].map(unpacked) };
      });
      const fitted = { value: one.at, row: 0, out: /** @type {Level[]} */ ([]), left: /** @type {Level[]} */ ([]) };
      const all = [...knots, fitted].sort((a, b) => a.value - b.value);
      const home = all.indexOf(fitted);
      return { ...one, all, home, place: home };
    });
    /** @param {typeof turned[0]} one Returns the two neighbouring simulated values, and their weights. */
    const between = ({ all, place }) => {
      const below = Math.min(Math.floor(place), all.length - 1);
      const share = place - below;
      return [{ knot: all[below], share: 1 - share }, { knot: all[Math.min(below + 1, all.length - 1)], share }]
        .filter((part) => part.share > 0);
    };
    const valueOf = (/** @type {typeof turned[0]} */ one) => between(one).reduce((sum, { knot, share }) => sum + share * knot.value, 0);

    const board = document.createElement("div");
    board.className = "turns";
    const said = document.createElement("p");
    said.className = "left";
    said.setAttribute("role", "status");
    const rows = turned.map((one) => {
      const label = document.createElement("label");
      const [name, slider, value] = [document.createElement("span"), document.createElement("input"), document.createElement("output")];
      name.textContent = one.name;
      Object.assign(slider, { type: "range", min: "0", max: String(one.all.length - 1), step: "0.02", value: String(one.place) });
      label.append(name, slider, value);
      board.append(label);
      const mark = svg("path", { class: "line ink-axis cursor", "stroke-width": 1 }, drawing);
      slider.addEventListener("input", () => { one.place = Number(slider.value); told(); });
      return { one, slider, value, mark };
    });
    const back = document.createElement("button");
    back.type = "button";
    back.textContent = "As fitted";
    back.addEventListener("click", () => { for (const { one, slider } of rows) { one.place = one.home; slider.value = String(one.home); } told(); });
    board.append(back, said);
    drawing.before(board);

    const told = () => {
      const parts = turned.flatMap(between).filter(({ knot }) => knot.row > 0);
      for (const { by, y, grid, base } of moved) {
        const sign = by === "out" ? 1 : -1;
        y.set(base);
        for (const { knot, share } of parts) {
          const change = knot[by][grid].y;
          for (let i = 0; i < y.length; i += 1) y[i] += sign * share * change[i];
        }
      }
      // x' V^-1 x of the residual x: that of the fitted set (row 0) minus the changes
      const weights = [{ row: 0, w: 1 }, ...parts.map(({ knot, share }) => ({ row: knot.row, w: -share }))];
      let squares = 0;
      for (const a of weights) for (const b of weights) squares += a.w * b.w * data.products[a.row][b.row];
      const times = Math.sqrt(Math.max(squares, 0));
      said.textContent = `Left on the test trials: ${withUnit((times * data.noise).toPrecision(3), data.unit)} (${times.toPrecision(3)}\u00a0\u00d7 the noise)`;
      said.dataset.times = String(times);
      for (const { one, slider, value, mark } of rows) {
        const now = valueOf(one);
        const words = withUnit(number(now, one.x[1] - one.x[0]), one.unit);
        value.textContent = words;
        slider.setAttribute("aria-valuetext", words);
        const { left, right, top, bottom } = one.panel;
        const x = left + ((now - one.x[0]) / (one.x[1] - one.x[0])) * (right - left);
        mark.setAttribute("d", `M${x} ${top}V${bottom}`);
      }
      redraw(link);
    };
    told();
  };

  /** @param {HTMLElement} figure Hides and shows the shapes of a static drawing by its legend. */
  const hidden = (figure) => {
    const off = switches(figure, () => {
      figure.querySelectorAll("svg .line, svg .area, svg .dots").forEach((shape) => {
        const gone = [...off].some((ink) => shape.classList.contains(ink));
        shape.classList.toggle("gone", gone);
      });
    });
  };

  document.documentElement.classList.add("answers");
  const order = ["time", "surface", "scatter", "bars", "turn"];
  const figures = [...document.querySelectorAll("figure")].map((figure) => {
    const script = figure.querySelector('script[type="application/json"]');
    return { figure, data: script ? JSON.parse(script.textContent || "{}") : { kind: "none" } };
  });
  figures.sort((a, b) => order.indexOf(a.data.kind) - order.indexOf(b.data.kind));
  for (const { figure, data } of figures) {
    if (data.kind === "time") time(figure, data);
    else if (data.kind === "surface") surface(figure, data);
    else if (data.kind === "scatter") scatter(figure, data);
    else if (data.kind === "bars") bars(figure, data);
    else if (data.kind === "turn") turn(figure, data);
    else hidden(figure);
  }
})();
