//! The verdict, from scores and test trials.

use crate::{
    diagnose::Options,
    diagnosis::{Candidate, Excess, VerdictKind},
    evidence::Evidence,
    fit::Bench,
    select::Solution,
};

/// The verdict and how it is told.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Decision {
    pub(crate) kind: VerdictKind,
    pub(crate) named: Vec<String>,
    pub(crate) sentence: String,
    pub(crate) notes: Vec<String>,
}

pub(crate) fn decide(
    bench: &Bench<'_>,
    options: &Options,
    evidence: &Evidence,
    best: &Solution,
    gap: Excess,
    candidates: &[Candidate],
) -> Decision {
    let thresholds = &options.thresholds;
    let Excess { raw, retuned: before, left: after } = gap;
    let specs = bench.simulator.effects();
    let mut notes = Vec::new();
    if bench.frame.borrowed_test {
        notes.push(
            "there is no test trial: the last quarter of every trial is held back and tested on"
                .into(),
        );
    }
    let none =
        |kind, sentence: String, notes| Decision { kind, named: Vec::new(), sentence, notes };
    let is_confirmed = candidates
        .first()
        .is_some_and(|c| !c.effects.is_empty() && c.is_confirmed && c.closed > 0.0);
    let left_allowed = thresholds.unknown_excess + thresholds.unknown_share * before;
    if !best.effects.is_empty() && is_confirmed && after <= left_allowed {
        let named: Vec<String> = candidates[0].effects.clone();
        let first = &candidates[0];
        let sentence = format!(
            "The simulator lacks {}: {} {:.0} % of the gap ({:.0} to {:.0} %) on trials that were not fitted; probability {:.2}.",
            named.join(" and "),
            if named.len() > 1 { "together they close" } else { "it closes" },
            100.0 * first.closed,
            100.0 * first.closed_ci[0],
            100.0 * first.closed_ci[1],
            first.probability
        );
        return Decision { kind: VerdictKind::Effect, named, sentence, notes };
    }
    if before > thresholds.null_excess && after > left_allowed {
        let worst = evidence
            .stages
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.excess_after.total_cmp(&b.1.excess_after))
            .map_or("", |(i, _)| bench.simulator.stages()[i].name.as_str());
        let best_name = best.effects.first().map_or("none", |&e| specs[e].name.as_str());
        let sentence = format!(
            "There is a gap in {worst} that the catalogue does not explain: {:.2} floors are left of {:.2} after the best ({best_name}).",
            after, before
        );
        return none(VerdictKind::Unknown, sentence, notes);
    }
    if raw > thresholds.null_excess {
        let sentence = format!(
            "No effect is missing: with its parameters re-tuned within their tolerances the simulator agrees with the rig (gap {raw:.1} floors as shipped, {:.2} re-tuned).",
            before
        );
        return none(VerdictKind::Parameters, sentence, notes);
    }
    none(VerdictKind::NoGap, "Simulator and rig agree within the noise floor.".into(), notes)
}
