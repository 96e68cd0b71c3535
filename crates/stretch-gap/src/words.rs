//! The answer in words, made from the verdict when nothing can change any more.

use crate::{
    diagnosis::{EffectShare, VerdictKind},
    evidence::Evidence,
    judge::{Case, Overruled, Verdict},
    simulator::Simulator,
};

/// Least share of the gap that is told of an effect that is not named.
const TOLD: f64 = 0.05;

/// What is told: the answer in one sentence, and what was noticed and assumed.
pub(crate) struct Told {
    pub(crate) sentence: String,
    pub(crate) notes: Vec<String>,
}

/// Tells a verdict.
pub(crate) fn tell(
    verdict: &Verdict,
    case: Case<'_>,
    simulator: &dyn Simulator,
    evidence: &Evidence,
    shares: &[EffectShare],
) -> Told {
    let mut notes = Vec::new();
    if evidence.frame.borrowed_test {
        let held =
            "there is no test trial: the last quarter of every trial is held back and tested on";
        notes.push(held.into());
    }
    let seen = seen(verdict.seen, case, simulator, evidence, shares);
    let sentence = match &verdict.overruled {
        None => seen,
        Some(overruled) => {
            notes.push(format!("before that was seen: {seen}"));
            wrong(overruled, simulator)
        }
    };
    Told { sentence, notes }
}

fn seen(
    kind: VerdictKind,
    case: Case<'_>,
    simulator: &dyn Simulator,
    evidence: &Evidence,
    shares: &[EffectShare],
) -> String {
    let gap = case.gap;
    match (kind, case.first) {
        (VerdictKind::Effect, Some(first)) => format!(
            "The simulator lacks {}: {} {:.0} % of the gap ({:.0} to {:.0} %) on trials that were not fitted; probability {:.2}.",
            first.effects.join(" and "),
            if first.effects.len() > 1 { "together they close" } else { "it closes" },
            100.0 * first.closed,
            100.0 * first.closed_ci[0],
            100.0 * first.closed_ci[1],
            first.probability
        ),
        (VerdictKind::Effect | VerdictKind::Unknown, _) => {
            let all = evidence.stages.iter().zip(simulator.stages());
            let worst = all.max_by(|a, b| a.0.excess_after.total_cmp(&b.0.excess_after));
            let best = evidence.best_effect.map(|e| simulator.effects()[e].name.as_str());
            format!(
                "There is a gap in {} that the catalogue does not explain: {:.2} floors are left of {:.2} after the best ({}).",
                worst.map_or("", |(_, spec)| spec.name.as_str()),
                gap.left,
                gap.retuned,
                best.unwrap_or("none")
            ) + &parts(shares)
        }
        (VerdictKind::Parameters, _) => format!(
            "No effect is missing: with its parameters re-tuned within their tolerances the simulator agrees with the rig (gap {:.1} floors as shipped, {:.2} re-tuned).",
            gap.raw, gap.retuned
        ),
        (VerdictKind::NoGap, _) => "Simulator and rig agree within the noise floor.".into(),
    }
}

/// Which effects close parts of a gap that no set of them explains.
fn parts(shares: &[EffectShare]) -> String {
    let told = shares.iter().filter(|s| s.closes >= TOLD).map(|s| {
        let end = if s.at_bound { " (at the end of its range)" } else { "" };
        format!("{} {:.0} %{end}", s.effect, 100.0 * s.closes)
    });
    let told: Vec<String> = told.collect();
    let all: f64 = shares.iter().map(|s| s.closes).sum();
    match told.is_empty() {
        true => String::new(),
        false => format!(
            " Parts of it close: {} ({:.0} % together, on trials that were fitted).",
            told.join(", "),
            100.0 * all
        ),
    }
}

/// Why it may not be the right simulator.
fn wrong(overruled: &Overruled, simulator: &dyn Simulator) -> String {
    match overruled {
        Overruled::Foreign { stage, share } => {
            let spec = &simulator.stages()[*stage];
            format!(
                "The gap is everything: {:.0} % of what {} does is not in the simulator of {}. Is it the right rig, and is every \
                 column what its name says?",
                100.0 * share.min(1.0),
                spec.channel,
                spec.name
            )
        }
        Overruled::Strained(strained) => {
            let names = strained.ended.iter().map(|&p| simulator.parameters()[p].name.as_str());
            format!(
                "The parameters of {} do not fit within their tolerances: {} stand at the end of them, and a gap of {:.1} floors is left \
                 all the same. Is it the right rig? If its parameters are right, something is missing that is not in the catalogue.",
                simulator.stages()[strained.stage].name,
                names.collect::<Vec<_>>().join(", "),
                strained.left
            )
        }
    }
}
