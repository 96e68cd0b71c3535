/*
 * A board on a serial port: a separate worker decodes the data, which are drawn, and kept until they are saved.
 */

/** Length of the plot, s. */
const WINDOW_S = 20;
/** Rows that are kept for the plot. */
const MOST_ROWS = 20_000;

const live = {
  /** @type {Hand|null} */
  hand: null,
  /** @type {ReadableStreamDefaultReader<Uint8Array>|null} */
  reader: null,
  /** Rows of the plot: time, signal and estimate. @type {[number, number, number][]} */
  rows: [],
  /** The recording: its header, then the received lines. @type {string[]} */
  lines: [],
  isDrawn: true,

  /** @param {string} whose @param {number} rate Samples per second. */
  use(whose, rate) {
    html("record-in-use").textContent = `The estimate comes from ${whose}.`;
    input("line-rate").value = String(Number(rate.toPrecision(6)));
  },

  async begin() {
    tell.wrong("");
    const port = await navigator.serial?.requestPort();
    if (!port) return;
    const form = select("form").value;
    live.hand?.end();
    live.hand = new Hand(() => {});
    live.rows = [];
    live.lines = [await live.hand.call("listen", form, input("adc").value, Number(input("line-rate").value), state.record)];
    tell.list("live-doubts", []);
    await port.open({ baudRate: Number(input("baud").value) });
    html("listening").hidden = false;
    button("save-trial").hidden = false;
    button("connect").textContent = "Disconnect";
    try {
      await live.listen(port);
    } finally {
      button("connect").textContent = "Connect";
      await port.close().catch(() => {});
    }
  },

  /** @param {SerialPort} port Receives until the port disappears or is disconnected. */
  async listen(port) {
    if (!port.readable || !live.hand) throw new Error("the port cannot be read; is another program listening?");
    live.reader = port.readable.getReader();
    try {
      for (;;) {
        const { value, done } = await live.reader.read();
        if (done) return;
        live.heard(await live.hand.call("heard", value, performance.now() / 1000));
      }
    } finally {
      live.reader.releaseLock();
      live.reader = null;
    }
  },

  /** @param {{rows: Float64Array, lines: string, status: string, doubts: string}} heard */
  heard({ rows, lines, status, doubts }) {
    for (let i = 0; i + 2 < rows.length; i += 3) live.rows.push([rows[i], rows[i + 1], rows[i + 2]]);
    if (live.rows.length > 2 * MOST_ROWS) live.rows.splice(0, live.rows.length - MOST_ROWS);
    if (lines) live.lines.push(lines);
    html("link").textContent = status;
    tell.list("live-doubts", doubts.split("\n").filter(Boolean));
    if (live.isDrawn) {
      live.isDrawn = false;
      requestAnimationFrame(live.draw);
    }
  },

  draw() {
    live.isDrawn = true;
    const end = live.rows.at(-1)?.[0] ?? 0;
    const seen = live.rows.filter((row) => row[0] >= end - WINDOW_S);
    const column = (/** @type {0|1|2} */ k) => Float64Array.from(seen, (row) => row[k]);
    const [x, signal, estimate] = [column(0), column(1), column(2)];
    const names = live.lines[0].trim().split(",");
    const name = names.find((n) => n.startsWith("estimate")) ?? "estimate";
    /** @type {Line[]} */
    const lines = [{ name: names[1], ink: "two", x, y: signal }];
    if (estimate.some(Number.isFinite)) lines.push({ name, ink: "three", x, y: estimate });
    plot.draw(part("trace", HTMLCanvasElement), lines);
    const last = estimate.at(-1);
    const unit = name.split("_")[1] ?? "";
    html("length").textContent = last === undefined || Number.isNaN(last) ? `${shown(signal.at(-1))}` : `${last.toFixed(2)} ${unit}`;
  },

  connect() {
    if (live.reader) {
      live.reader.cancel().catch(() => {});
      return;
    }
    // the user closed the dialog without choosing a port
    const isNone = (/** @type {any} */ error) => error?.name === "NotFoundError" || error instanceof Cancelled;
    live.begin().catch((error) => { if (!isNone(error)) tell.wrong(error); });
  },

  wire() {
    html("no-serial").hidden = Boolean(navigator.serial);
    html("serial").hidden = !navigator.serial;
    button("connect").onclick = live.connect;
    button("save-trial").onclick = () => tell.save("trial.csv", live.lines.join(""), "text/csv");
    select("form").onchange = () => { html("per-second").hidden = select("form").value === "frames"; };
  },
};
