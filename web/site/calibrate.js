/*
 * A calibration: a model, or the one that does best on trials left out, which workers judge side by side.
 */

/** @typedef {{method: string, average_error_percent: number, rmse: number, r_squared: number|null, lag_s: number|null}} MethodErrors */
/** @typedef {{model: string, rmse: number|null, rmse_arbitrary: number|null, rmse_pulses: number|null, rmse_ramps: number|null, parameters: number, problem: string|null}} ModelRow */

/** Workers beyond it wait for memory more than they work. */
const MOST_HANDS = 4;

const calibration = {
  choices: () => ({ model: select("model").value, reference: select("reference").value, signal: select("signal").value }),

  /** A column that is no column of numbers is refused as the program refuses it. @param {Hand} hand */
  async checked(hand) {
    const { reference, signal } = calibration.choices();
    for (const [name, about] of state.recordings) {
      const file = state.files.get(name);
      const has = (/** @type {string} */ column) => about.columns.some((c) => c.name === column);
      if (file && !(has(reference) && has(signal))) await crew.read(hand, name, file, [reference, signal]);
    }
  },

  /** Judges every model, as many at once as there are cores. @param {Hand} first @param {object} choices */
  async judged(first, choices) {
    const asked = JSON.stringify(choices);
    /** @type {string[]} */
    const models = JSON.parse(await first.call("models", asked));
    // the slowest first: none of them is begun last
    const left = [...models].reverse();
    const judged = new Map();
    const count = Math.min(navigator.hardwareConcurrency || 1, MOST_HANDS, models.length);
    const work = async (/** @type {number} */ i) => {
      const hand = i ? await crew.stocked(i) : first;
      for (let model = left.shift(); model; model = left.shift()) {
        tell.doing(`judging ${models.length} models on trials left out, ${judged.size} done`);
        judged.set(model, JSON.parse(await hand.call("judge", asked, model)));
      }
    };
    await Promise.all(Array.from({ length: count }, (_, i) => work(i))).finally(crew.dismiss);
    return models.map((model) => [model, judged.get(model)]);
  },

  run: () => tell.busy("calibrating", async () => {
    html("calibrated").hidden = true;
    const hand = await crew.stocked(CALIBRATOR);
    await calibration.checked(hand);
    /** @type {any} */
    let choices = calibration.choices();
    if (choices.model === "auto" || choices.model.startsWith("diagnosed")) {
      tell.doing("diagnosing the gauge");
      choices = { ...choices, ...JSON.parse(await hand.call("causes", JSON.stringify(choices))) };
    }
    if (choices.model === "auto") choices = { ...choices, judged: await calibration.judged(hand, choices) };
    tell.doing(`fitting ${choices.model}`);
    const begun = performance.now();
    const made = JSON.parse(await hand.call("calibrate", JSON.stringify(choices)));
    html("fitted").dataset.ms = String(Math.round(performance.now() - begun));
    calibration.tell(made);
    calibration.converter(choices.signal);
    state.record = await hand.call("record");
    live.use(`the calibration of ${choices.reference} on ${choices.signal}`);
    html("calibrated").classList.remove("stale");
    html("calibrated").hidden = false;
    tell.doing("judging it");
    calibration.judgement(JSON.parse(await hand.call("evaluate")));
  }),

  /** A converter of 0 to 3.3 V in the unit of the signal, unless another was written. @param {string} signal */
  converter(signal) {
    const column = [...state.recordings.values()].flatMap((a) => a.columns).find((c) => c.name === signal);
    const per = /** @type {Record<string, string>} */ ({ mv: "3300", uv: "3300000", "µv": "3300000" });
    const isOurs = ["3.3", ...Object.values(per)].some((last) => input("adc").value === `12,0,${last}`);
    if (isOurs) input("adc").value = `12,0,${per[column?.unit.toLowerCase() ?? ""] ?? "3.3"}`;
  },

  /** @param {{model: string, unit: string, models: ModelRow[], notes: string[]}} made */
  tell(made) {
    html("fitted").textContent = `${made.models.length ? "Chosen: " : ""}${made.model}.`;
    tell.list("remarks", made.notes);
    html("models").hidden = !made.models.length;
    const row = (/** @type {ModelRow} */ m) =>
      [m.model, shown(m.rmse), shown(m.rmse_arbitrary), shown(m.rmse_pulses), shown(m.rmse_ramps), m.problem ?? String(m.parameters)];
    tell.table("rows", made.models.map(row), made.models.findIndex((m) => m.model === made.model));
    tell.table("errors", []);
    tell.list("doubts", []);
    html("judged-on").textContent = "";
    html("unit").textContent = made.unit;
  },

  /** @param {{evaluation: {unit: string, trials: {trial: string}[], pooled: MethodErrors[]}, doubts: {text: string}[], held_out: boolean}} judgement */
  judgement({ evaluation: { unit, trials, pooled }, doubts, held_out }) {
    const row = (/** @type {MethodErrors} */ e) =>
      [e.method, shown(e.average_error_percent, 3), shown(e.rmse), e.r_squared?.toFixed(4).replace("-", "−") ?? "–", shown(e.lag_s, 3)];
    tell.table("errors", pooled.map(row), pooled.length - 1);
    tell.list("doubts", doubts.map((doubt) => doubt.text));
    const names = trials.map((t) => t.trial);
    const own = pooled[pooled.length - 1];
    const where = held_out ? "on recordings that were not fitted" : "on the data of the fit: for an honest error drop another recording and choose “only test” for it above";
    html("fitted").textContent += ` Off by ${shown(own.rmse, 3)} ${unit} (root mean square) ${where}.`;
    html("judged-on").textContent = `Judged on ${names.slice(0, 4).join(", ")}${names.length > 4 ? ` and ${names.length - 4} more` : ""}.`;
  },

  /** @param {string} name @param {string} method @param {string[]} args */
  save: (name, method, ...args) => tell.busy("writing", async () => {
    tell.save(name, await crew.hand(CALIBRATOR).call(method, ...args));
  }),
};
