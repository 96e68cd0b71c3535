/*
 * Reads dropped files, shows them, and connects the buttons to their functions.
 */

/** Columns that are inputs of the rig, and therefore neither reference nor signal. */
const COMMANDS = ["inlet", "outlet", "pressure_kpa", "excitation_share", "set_length_mm", "shunt_share"];
/** Seed of the sample. */
const SAMPLE = 1;
/** Largest number of recordings for which the list is open at first. */
const MOST_OPEN = 4;
/** Largest number of points of the picture. */
const MOST_POINTS = 1500;

const page = {
  /** @param {Map<string, File>} files Adds dropped files. If a recording has other columns than the sample, the files replace the sample. */
  async take(files) {
    await page.read(files);
    const columns = [...state.recordings.values()].map(({ name, columns }) => ({ name, names: columns.map((c) => c.name) }));
    const sample = columns.find(({ name }) => page.sampled.has(name))?.names ?? [];
    const isOther = columns.some(({ name, names }) => files.has(name) && !page.sampled.has(name) && !sample.every((column) => names.includes(column)));
    if (!isOther || !sample.length) return;
    page.clear();
    await page.read(files);
  },
  /** Names of the recordings of the sample. @type {Set<string>} */
  sampled: new Set(),

  /** @param {Map<string, File>} files */
  read: (files) => tell.busy("reading", async () => {
    page.changed("calibrated", "diagnosed", "evaluated");
    for (const [name, file] of files) {
      // added at the end, because the last of several calibration files or rig files is used
      state.files.delete(name);
      state.files.set(name, file);
      crew.hands.forEach((hand) => hand.has.delete(name));
    }
    // dataset.toml and other TOML files come first, because they describe how the others are read
    const isFirst = (/** @type {string} */ name) => (name === "dataset.toml" ? 0 : name.endsWith(".toml") ? 1 : 2);
    const names = [...files.keys()].sort((a, b) => isFirst(a) - isFirst(b));
    const hand = crew.hand(CALIBRATOR);
    const wrong = [];
    for (const [i, name] of names.entries()) {
      const file = files.get(name);
      if (!file) continue;
      tell.doing(`reading ${name}${names.length > 1 ? ` (${i + 1} of ${names.length})` : ""}`);
      try {
        await page.told(await crew.read(hand, name, file), file);
        page.refused.delete(name);
      } catch (error) {
        if (error instanceof Cancelled) throw error;
        state.files.delete(name);
        state.recordings.delete(name);
        page.refused.set(name, file);
        wrong.push(error instanceof Error ? error.message : String(error));
      }
    }
    await page.show();
    if (!wrong.length) return;
    part("reading", HTMLDetailsElement).open = true;
    tell.wrong(wrong.join("\n"));
  }),

  /** @param {any} about @param {File} file */
  async told(about, file) {
    if (about.kind === "recording") state.recordings.set(about.name, about);
    if (about.kind === "record") {
      state.record = await file.text();
      state.dropped = about;
      html("record-dropped").textContent = `${about.name}: ${about.reference} on ${about.signal}, ${shown(about.rate_hz)} samples per second.`;
      live.use(`${about.name}, ${about.reference} on ${about.signal}`, about.rate_hz);
    }
  },

  async show() {
    const all = [...state.recordings.values()];
    for (const id of ["calibration", "diagnosis"]) html(id).hidden = !all.length;
    html("evaluation").hidden = !all.length || !state.dropped;
    html("recordings").hidden = !all.length && !page.refused.size;
    html("clear").hidden = html("recordings").hidden;
    tell.table("list", {
      head: ["file", "rows", "seconds", "samples per second", "columns", "use"],
      rows: all.map((a) => [a.name, String(a.rows), shown(a.seconds, 5), shown(a.rate_hz, 4), a.columns.map((c) => c.name).join(", ")]),
    });
    page.uses();
    const sum = (/** @type {(a: About) => number} */ of) => all.reduce((before, a) => before + of(a), 0);
    html("counted").textContent =
      `${all.length === 1 ? "1 recording" : `${all.length} recordings`}, ${sum((a) => a.rows)} rows, ${shown(sum((a) => a.seconds), 6)} s`;
    part("each", HTMLDetailsElement).open = all.length <= MOST_OPEN;
    const hasRig = [...state.files.keys()].some((name) => name.endsWith(".toml") && name !== "dataset.toml");
    /** @type {string[]} */
    const rigs = hasRig ? JSON.parse(await (await crew.stocked(CALIBRATOR)).call("rig_notes")) : [];
    tell.list("notes", [...all.flatMap((a) => a.notes.map((note) => `${a.name}: ${note}`)), ...rigs]);
    page.guess(all);
    page.options("shown", all.map((a) => a.name), select("shown").value);
    await page.look();
  },

  /** Shows the use of each recording: fitting or testing. The user chooses it unless there is a dataset.toml. */
  uses() {
    const isSaid = state.files.has("dataset.toml");
    for (const row of html("list").querySelectorAll("tr")) {
      const name = row.firstElementChild?.textContent ?? "";
      const cell = row.insertCell();
      cell.dataset.head = "use";
      if (isSaid) {
        cell.textContent = "as dataset.toml says";
        continue;
      }
      const choice = document.createElement("select");
      choice.ariaLabel = `use of ${name}`;
      choice.append(new Option("fit", "fit"), new Option("only test", "test"));
      choice.value = state.held.has(name) ? "test" : "fit";
      choice.onchange = () => {
        choice.value === "test" ? state.held.add(name) : state.held.delete(name);
        page.changed("calibrated", "diagnosed", "evaluated");
      };
      cell.append(choice);
    }
  },

  /** @param {string} id @param {string[]} names @param {string} wanted */
  options(id, names, wanted) {
    select(id).replaceChildren(...names.map((name) => new Option(name, name)));
    if (names.includes(wanted)) select(id).value = wanted;
  },

  /** Chooses the columns of reference and signal: as before, or else by the usual names, units and words. @param {About[]} all */
  guess(all) {
    const columns = [...new Map(all.flatMap((a) => a.columns).map((c) => [c.name, c])).values()];
    const free = columns.filter((c) => !COMMANDS.includes(c.name) && !c.name.startsWith("estimate"));
    const by = (/** @type {string[]} */ units, /** @type {RegExp} */ name) =>
      free.find((c) => units.includes(c.unit.toLowerCase())) ?? free.find((c) => name.test(c.name.toLowerCase()));
    const usual = (/** @type {string} */ name) => free.find((c) => c.name === name);
    const reference = usual("length_mm") ?? by(["mm", "cm", "m", "deg", "rad"], /length|angle|pos|ref|truth/) ?? free[0];
    const others = free.filter((c) => c !== reference);
    const signal = usual("bridge_v") ?? others.find((c) => ["v", "mv", "ohm", "kohm"].includes(c.unit.toLowerCase())) ?? others[0];
    const names = columns.map((c) => c.name);
    for (const [id, found] of /** @type {[string, Column|undefined][]} */ ([["reference", reference], ["signal", signal]])) {
      const before = select(id).value;
      page.options(id, names, names.includes(before) ? before : found?.name ?? "");
    }
    const isRig = all.length > 0 && all.every((a) => ["inlet", "outlet", "length_mm", "bridge_v"].every((n) => a.columns.some((c) => c.name === n)));
    const rig = select("subject").options[0];
    if (rig.disabled === isRig) select("subject").value = isRig ? "rig" : "gauge";
    rig.disabled = !isRig;
  },

  /** Marks results as out of date, because the choices changed. @param {string[]} ids */
  changed: (...ids) => ids.forEach((id) => page.mark(id, true)),

  /** @param {string} id Marks results as up to date. */
  fresh: (id) => page.mark(id, false),

  /** Hides results before they are computed again. @param {string} id */
  begin(id) {
    html(id).hidden = true;
    if (report.of === id) report.close();
  },

  /** Sets whether results are out of date; such results can neither be saved nor shown as a report. @param {string} id @param {boolean} isStale */
  mark(id, isStale) {
    html(id).classList.toggle("stale", isStale);
    for (const one of html(id).querySelectorAll("button")) one.disabled = isStale;
    if (isStale && report.of === id) report.close();
  },

  async look() {
    const [name, reference, signal] = ["shown", "reference", "signal"].map((id) => select(id).value);
    if (!name) return;
    const hand = await crew.stocked(CALIBRATOR);
    const points = await hand.call("points", name, reference, signal, MOST_POINTS);
    const column = (/** @type {number} */ k) => Float64Array.from({ length: points.length / 3 }, (_, i) => points[3 * i + k]);
    const canvas = part("look", HTMLCanvasElement);
    canvas.setAttribute("aria-label", `${reference} and ${signal} of ${name} over ${shown(state.recordings.get(name)?.seconds)} s`);
    page.lines = [{ name: reference, ink: "truth", x: column(0), y: column(1) }, { name: signal, ink: "two", x: column(0), y: column(2) }];
    plot.draw(canvas, page.lines);
  },
  /** @type {Line[]} */
  lines: [],

  again: () => {
    const rate = Number(input("rate").value);
    state.asked = {
      time: input("time").value.trim(), time_unit: select("time-unit").value, columns: input("columns").value.trim(),
      ...(rate > 0 ? { sample_rate_hz: rate } : {}),
    };
    state.edition += 1;
    return page.take(new Map([...state.files, ...page.refused]));
  },
  /** Files that could not be read. They are read again with other options. @type {Map<string, File>} */
  refused: new Map(),

  clear() {
    crew.end();
    state.files.clear();
    state.recordings.clear();
    state.held.clear();
    page.refused.clear();
    page.sampled.clear();
    state.dropped = null;
    for (const id of ["calibrated", "diagnosed", "evaluated"]) html(id).hidden = true;
    tell.list("record-doubts", []);
    report.close();
    tell.wrong("");
    page.show();
  },

  sample: () => {
    /** @type {Map<string, File>} */
    const files = new Map();
    const made = tell.busy("simulating a session", async () => {
      for (const { name, text } of JSON.parse(await crew.hand(CALIBRATOR).call("sample", SAMPLE))) files.set(name, new File([text], name));
    });
    return made.then(() => {
      page.sampled = new Set(files.keys());
      return files.size ? page.take(files) : undefined;
    });
  },
};

/** Collects the dropped files, including those in folders, with their paths in the folder as names. */
const dropped = {
  /** @param {Entry} entry @param {string} path @param {Map<string, File>} into @returns {Promise<void>} */
  async walk(entry, path, into) {
    if (entry.isFile) {
      into.set(path, await new Promise((/** @type {(file: File) => void} */ take, fail) => entry.file(take, fail)));
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((/** @type {(entries: Entry[]) => void} */ take, fail) => reader.readEntries(take, fail));
      if (!some.length) return;
      for (const one of some) await dropped.walk(one, path ? `${path}/${one.name}` : one.name, into);
    }
  },

  /** @param {Handle} handle @param {string} path @param {Map<string, File>} into @returns {Promise<void>} */
  async open(handle, path, into) {
    if (handle.kind === "file") {
      into.set(path, await handle.getFile());
      return;
    }
    for await (const one of handle.values()) await dropped.open(one, path ? `${path}/${one.name}` : one.name, into);
  },

  /** @param {DataTransfer} data */
  async files(data) {
    /** @type {Map<string, File>} */
    const into = new Map();
    // all entries are requested at once, because the browser clears the dropped data after this call
    const plain = [...data.files];
    const items = [...data.items].filter((item) => item.kind === "file");
    const entries = items.map((item) => /** @type {Entry|null} */ (/** @type {any} */ (item).webkitGetAsEntry?.() ?? null));
    if (!entries.some((entry) => entry && !entry.isFile)) {
      plain.forEach((file) => into.set(file.name, file));
      return into;
    }
    // if the page was opened from a disk, Chromium gives access to a folder only by its handle, Firefox and Safari by its entry
    const handles = items.map((item) => /** @type {Promise<Handle>|undefined} */ (/** @type {any} */ (item).getAsFileSystemHandle?.()));
    for (const [i, entry] of entries.entries()) {
      const handle = await handles[i];
      const path = entry && !entry.isFile ? "" : entry?.name ?? "";
      if (handle) await dropped.open(handle, path, into);
      else if (entry) await dropped.walk(entry, path, into);
    }
    return into;
  },
};

(() => {
  const zone = html("drop");
  const over = (/** @type {boolean} */ is) => (/** @type {DragEvent} */ event) => {
    event.preventDefault();
    zone.classList.toggle("over", is);
  };
  document.addEventListener("dragover", over(true));
  document.addEventListener("dragleave", over(false));
  document.addEventListener("drop", (event) => {
    over(false)(event);
    if (event.dataTransfer) dropped.files(event.dataTransfer).then((files) => page.take(files), tell.wrong);
  });
  input("choose").onchange = () => {
    const files = [...(input("choose").files ?? [])];
    page.take(new Map(files.map((file) => [file.name, file])));
    input("choose").value = "";
  };
  button("sample").onclick = page.sample;
  button("clear").onclick = page.clear;
  button("cancel").onclick = crew.cancel;
  button("again").onclick = page.again;
  for (const id of ["reference", "signal", "shown"]) {
    select(id).onchange = () => {
      if (id !== "shown") page.changed("calibrated", "diagnosed");
      page.look().catch(tell.wrong);
    };
  }
  select("model").onchange = () => page.changed("calibrated");
  select("subject").onchange = () => page.changed("diagnosed");
  button("evaluate").onclick = evaluation.run;
  button("save-estimates").onclick = evaluation.save;
  button("calibrate").onclick = calibration.run;
  button("save-record").onclick = () => calibration.save("calibration.json", "record");
  button("save-header").onclick = () => calibration.save("stretch.h", "header", input("adc").value);
  button("see-calibration").onclick = () => tell.busy("drawing the report", async () => {
    report.open("calibrated", "calibration.html", calibration.title, await crew.hand(CALIBRATOR).call("report"));
  });
  button("diagnose").onclick = diagnosis.run;
  button("see-diagnosis").onclick = () => tell.busy("drawing the report", async () => {
    report.open("diagnosed", "diagnosis.html", diagnosis.title, await crew.hand(DIAGNOSER).call("diagnosis", "report"));
  });
  button("save-diagnosis").onclick = () => diagnosis.save("diagnosis.json", "json");
  button("save-rig").onclick = () => diagnosis.save("fixed.toml", "rig");
  button("save-report").onclick = () => tell.save(report.name, report.text, "text/html");
  button("close-report").onclick = report.close;
  window.addEventListener("resize", report.fit);
  window.addEventListener("resize", () => { if (page.lines.length) plot.draw(part("look", HTMLCanvasElement), page.lines); });
  live.wire();
  // the first worker starts together with the page, so that the first file is read without delay
  const first = crew.hand(CALIBRATOR);
  first.ready.then(async ({ version, models }) => {
    html("version").textContent = version;
    page.options("model", ["auto", ...models], "auto");
    /** @type {Record<string, string>} Descriptions of the models. Models that are not listed have memory. */
    const words = { auto: "least error on trials left out", linear: "a line", poly13: "as published" };
    for (const option of select("model").options) {
      const rest = option.value.endsWith("+rest") ? ", follows drift" : "";
      option.text = `${option.value}: ${words[option.value] ?? "with memory"}${rest}`;
    }
    html("bits").textContent = `${await first.call("sound")} test calibrations gave the same results in this browser, bit for bit, as in the program and on boards`;
  }).catch(tell.wrong);
})();
