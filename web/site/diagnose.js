/*
 * A diagnosis of the whole rig or of the gauge alone.
 */

/** @typedef {{sentence: string, notes: string[], seconds: number, candidates: string[][], caption: string, no_rig: string|null}} Told */

const diagnosis = {
  run: () => tell.busy("preparing", async () => {
    html("diagnosed").hidden = true;
    const hand = await crew.stocked(DIAGNOSER);
    const alone = select("subject").value === "gauge";
    if (alone) await calibration.checked(hand);
    const { reference, signal } = calibration.choices();
    diagnosis.tell(JSON.parse(await hand.call("diagnose", JSON.stringify({ reference, signal, alone }))));
  }),

  /** @param {Told} told */
  tell({ sentence, notes, seconds, candidates, caption, no_rig }) {
    html("sentence").textContent = sentence;
    html("sentence").dataset.seconds = String(seconds);
    tell.list("findings", notes);
    html("candidates-caption").textContent = caption;
    tell.table("candidates", candidates, 0);
    button("save-rig").disabled = no_rig !== null;
    html("no-rig").textContent = no_rig ? `No rig file: ${no_rig}.` : "";
    html("diagnosed").classList.remove("stale");
    html("diagnosed").hidden = false;
  },

  /** @param {string} name @param {string} which */
  save: (name, which) => tell.busy("writing", async () => {
    tell.save(name, await crew.hand(DIAGNOSER).call("diagnosis", which));
  }),
};
