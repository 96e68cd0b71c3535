/*
 * Calibration with a given model, or with the model that has the smallest error on trials that were left out of the fit.
 * Workers evaluate the models in parallel.
 */

/** @typedef {{sentence: string, table: Shown, trials: string[], doubts: string[]}} Errors */
/** @typedef {{model: string, rmse: number|null, rmse_arbitrary: number|null, rmse_pulses: number|null, rmse_ramps: number|null, parameters: number, problem: string|null}} ModelRow */
/** @typedef {{model: string, unit: string, rate_hz: number, why: [string, string]|null, models: ModelRow[], notes: string[]}} Made */

/** Largest number of workers. With more, memory access limits the speed. */
const MOST_HANDS = 4;

const calibration = {
  /** Title of the report: what was calibrated. */
  title: "",

  choices: () => ({ model: select("model").value, reference: select("reference").value, signal: select("signal").value }),

  /** Reads recordings again that lack a chosen column of numbers, so that the error is that of the program. @param {Hand} hand @param {{reference: string, signal: string}} choices */
  async checked(hand, { reference, signal }) {
    for (const [name, about] of state.recordings) {
      const file = state.files.get(name);
      const has = (/** @type {string} */ column) => about.columns.some((c) => c.name === column);
      if (file && !(has(reference) && has(signal))) await crew.read(hand, name, file, [reference, signal]);
    }
  },

  /** Evaluates all models, with at most one worker per core. @param {Hand} first @param {object} choices */
  async judged(first, choices) {
    const asked = JSON.stringify(choices);
    /** @type {string[]} */
    const models = JSON.parse(await first.call("models", asked));
    // the slowest models come first, so that none of them starts last
    const left = [...models].reverse();
    const judged = new Map();
    /** @type {Set<string>} */
    const begun = new Set();
    const progress = () => {
      const running = [...begun].filter((model) => !judged.has(model));
      return `testing ${models.length} models on data left out of the fit, ${judged.size} done${running.length ? `, now ${running.join(" and ")}` : ""}`;
    };
    const count = Math.min(navigator.hardwareConcurrency || 1, MOST_HANDS, models.length);
    const work = async (/** @type {number} */ i) => {
      const hand = i ? await crew.stocked(i) : first;
      for (let model = left.shift(); model; model = left.shift()) {
        begun.add(model);
        tell.doing(progress());
        judged.set(model, JSON.parse(await hand.call("judge", asked, model)));
        tell.doing(progress());
      }
    };
    await Promise.all(Array.from({ length: count }, (_, i) => work(i))).finally(crew.dismiss);
    return models.map((model) => [model, judged.get(model)]);
  },

  run: () => tell.busy("calibrating", async () => {
    page.begin("calibrated");
    const hand = await crew.stocked(CALIBRATOR);
    await calibration.checked(hand, calibration.choices());
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
    live.use(`the calibration of ${choices.reference} on ${choices.signal}`, made.rate_hz);
    calibration.title = `calibration of ${choices.reference} on ${choices.signal}, ${made.model}`;
    page.fresh("calibrated");
    html("calibrated").hidden = false;
    tell.doing("judging it");
    calibration.judgement(made, JSON.parse(await hand.call("evaluate")));
    tell.announce(html("fitted").textContent ?? "");
  }),

  /** A converter of 0 to 3.3 V in the unit of the signal, unless another was written. @param {string} signal */
  converter(signal) {
    const column = [...state.recordings.values()].flatMap((a) => a.columns).find((c) => c.name === signal);
    const per = /** @type {Record<string, string>} */ ({ mv: "3300", uv: "3300000", "µv": "3300000" });
    const isOurs = ["3.3", ...Object.values(per)].some((last) => input("adc").value === `12,0,${last}`);
    if (isOurs) input("adc").value = `12,0,${per[column?.unit.toLowerCase() ?? ""] ?? "3.3"}`;
  },

  /** @param {Made} made */
  tell({ model, unit, why, models, notes }) {
    html("fitted").textContent = why ? `Chosen: ${why[0]}.` : `${model} was fitted.`;
    tell.list("remarks", notes);
    html("models").hidden = !models.length;
    /** @type {[string, (m: ModelRow) => number|null][]} Kinds of recordings: of one kind alone the column would repeat the RMSE. */
    const kinds = [["arbitrary", (m) => m.rmse_arbitrary], ["pulses", (m) => m.rmse_pulses], ["ramps", (m) => m.rmse_ramps]];
    const known = kinds.filter(([, of]) => models.some((m) => of(m) !== null));
    const split = known.length > 1 ? known : [];
    tell.table("rows", {
      head: [`model, tested on ${why?.[1]} left out`, calibration.unit("RMSE", unit), ...split.map(([kind]) => calibration.unit(kind, unit)), "parameters"],
      rows: models.map((m) => [m.model, shown(m.rmse), ...split.map(([, of]) => shown(of(m))), m.problem ?? String(m.parameters)]),
      best: models.findIndex((m) => m.model === model),
    });
    tell.table("errors", { head: [], rows: [] });
    tell.list("doubts", []);
    html("judged-on").textContent = "";
  },

  /** @param {string} name @param {string} unit */
  unit: (name, unit) => (unit ? `${name}, ${unit}` : name),

  /** @param {Made} made @param {Errors & {held_out: boolean}} errors */
  judgement({ why }, errors) {
    const isFirst = !why || errors.held_out;
    html("fitted").textContent = [why ? html("fitted").textContent : "", isFirst ? errors.sentence : ""].join(" ").trim();
    tell.table("errors", errors.table);
    tell.list("doubts", errors.doubts);
    const advice = "These recordings were fitted. To see an honest error, drop another recording and choose “only test” for it above.";
    html("judged-on").textContent = `${calibration.judgedOn(errors.trials)}${errors.held_out ? "" : ` ${advice}`}`;
  },

  /** @param {string[]} names */
  judgedOn: (names) => `Judged on ${names.slice(0, 4).join(", ")}${names.length > 4 ? ` and ${names.length - 4} more` : ""}.`,

  /** @param {string} name @param {string} method @param {string[]} args */
  save: (name, method, ...args) => tell.busy("writing", async () => {
    tell.save(name, await crew.hand(CALIBRATOR).call(method, ...args));
  }),
};

/** A dropped calibration file: its errors on the recordings, and its estimates. */
const evaluation = {
  run: () => tell.busy("evaluating", async () => {
    page.begin("evaluated");
    const hand = await crew.stocked(CALIBRATOR);
    if (state.dropped) await calibration.checked(hand, state.dropped);
    /** @type {Errors} */
    const errors = JSON.parse(await hand.call("evaluate_record"));
    html("off").textContent = errors.sentence;
    tell.table("record-errors", errors.table);
    tell.list("record-doubts", errors.doubts);
    html("record-judged-on").textContent = calibration.judgedOn(errors.trials);
    html("evaluated").hidden = false;
    page.fresh("evaluated");
    tell.announce(errors.sentence);
  }),

  save: () => tell.busy("applying the calibration", async () => {
    const hand = await crew.stocked(CALIBRATOR);
    const { csv, doubts } = JSON.parse(await hand.call("estimates", select("shown").value));
    tell.list("record-doubts", doubts);
    tell.save("estimate.csv", csv, "text/csv");
  }),
};
