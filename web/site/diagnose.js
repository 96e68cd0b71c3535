/*
 * A diagnosis of the whole rig or of the gauge alone.
 */

/** @typedef {{sentence: string, notes: string[], seconds: number, candidates: Shown, caption: string, no_rig: string|null}} Told */

const diagnosis = {
  /** Title of the report: what was diagnosed. */
  title: "",

  run: () => tell.busy("preparing", async () => {
    page.begin("diagnosed");
    const hand = await crew.stocked(DIAGNOSER);
    const alone = select("subject").value === "gauge";
    if (alone) await calibration.checked(hand, calibration.choices());
    const { reference, signal } = calibration.choices();
    diagnosis.title = `diagnosis of ${alone ? `${reference} on ${signal}` : "the whole rig"}`;
    diagnosis.tell(JSON.parse(await hand.call("diagnose", JSON.stringify({ reference, signal, alone }))));
  }),

  /** @param {Told} told */
  tell({ sentence, notes, seconds, candidates, caption, no_rig }) {
    html("sentence").textContent = sentence;
    html("sentence").dataset.seconds = String(seconds);
    tell.list("findings", notes);
    html("candidates-caption").textContent = caption;
    tell.table("candidates", candidates);
    page.fresh("diagnosed");
    button("save-rig").disabled = no_rig !== null;
    html("no-rig").textContent = no_rig ? `No rig file: ${no_rig}.` : "";
    html("diagnosed").hidden = false;
    tell.announce(sentence);
  },

  /** @param {string} name @param {string} which */
  save: (name, which) => tell.busy("writing", async () => {
    tell.save(name, await crew.hand(DIAGNOSER).call("diagnosis", which));
  }),
};
