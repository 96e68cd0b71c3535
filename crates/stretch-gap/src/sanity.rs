//! Is it the right simulator at all?

use crate::{
    diagnosis::{Diagnosis, VerdictKind},
    evidence::Evidence,
    frame::Role,
    simulator::Simulator,
};

/// Tolerances at which a parameter stands at its end: two of the five or so of a stage do so by chance in one rig of a few
/// thousand.
const END: f64 = 2.75;
/// Excess that must be left for that to count: more error than noise, and more of the gap than the form of an effect leaves.
const LEFT: f64 = 1.0;
const LEFT_SHARE: f64 = 0.03;

/// Takes names back where the data come from something else than the simulator is of.
///
/// Either more of a channel's variance is left on the test trials with the best effects in than the simulator says that
/// may be ([`Simulator::foreign_share`]): another rig, or a column that is not what its name says. Or two parameters of a stage stand at the end of their tolerances and more
/// than noise is left of it all the same: what bends them is no effect but other parameters.
pub(crate) fn check(simulator: &dyn Simulator, evidence: &Evidence, diagnosis: &mut Diagnosis) {
    let sentence = foreign(simulator, evidence).or_else(|| strained(simulator, evidence));
    let Some(sentence) = sentence else { return };
    diagnosis.notes.push(format!("before that was seen: {}", diagnosis.sentence));
    diagnosis.verdict = VerdictKind::Unknown;
    diagnosis.named.clear();
    diagnosis.sentence = sentence;
}

/// The channel that the simulator has least to do with, if any.
fn foreign(simulator: &dyn Simulator, evidence: &Evidence) -> Option<String> {
    let mut worst: Option<(usize, f64)> = None;
    for (stage, traces) in evidence.stages.iter().enumerate() {
        let measured = simulator.measured(stage);
        let (mut count, mut sum, mut squares, mut left) = (0.0, 0.0, 0.0, 0.0);
        for segment in evidence.frame.of_role(Role::Test) {
            for i in segment.from..segment.to {
                count += 1.0;
                sum += measured[i];
                squares += measured[i] * measured[i];
                left += (measured[i] - traces.after[i]).powi(2);
            }
        }
        let variance = squares - sum * sum / f64::max(count, 1.0);
        // What is noise is nobody's fault.
        let noise = count * traces.floor * traces.floor;
        let share = (left - noise) / variance.max(noise).max(f64::MIN_POSITIVE);
        if share > simulator.foreign_share() && worst.is_none_or(|w| share > w.1) {
            worst = Some((stage, share));
        }
    }
    let (stage, share) = worst?;
    let spec = &simulator.stages()[stage];
    Some(format!(
        "The gap is everything: {:.0} % of what {} does is not in the simulator of {}. Is it the right rig, and is every \
         column what its name says?",
        100.0 * share.min(1.0),
        spec.channel,
        spec.name
    ))
}

/// The stage whose parameters are strained most, if any.
fn strained(simulator: &dyn Simulator, evidence: &Evidence) -> Option<String> {
    let specs = simulator.parameters();
    let at_end = |index: &&usize| {
        let spec = &specs[**index];
        spec.sd > 0.0
            && spec.is_evidence
            && (evidence.best.parameters[**index] - spec.nominal).abs() >= END * spec.sd
    };
    let left = |stage: usize| evidence.stages[stage].excess_after;
    let is_bad =
        |stage: usize| left(stage) > LEFT.max(LEFT_SHARE * evidence.stages[stage].excess_retuned);
    let stages = simulator.stages().iter().enumerate().filter(|(stage, _)| is_bad(*stage));
    let strained = stages.filter_map(|(stage, spec)| {
        let names: Vec<&str> =
            spec.parameters.iter().filter(at_end).map(|&p| specs[p].name.as_str()).collect();
        (names.len() >= 2).then_some((stage, spec, names))
    });
    let (stage, spec, names) = strained.max_by(|a, b| left(a.0).total_cmp(&left(b.0)))?;
    Some(format!(
        "The parameters of {} do not fit within their tolerances: {} stand at the end of them, and a gap of {:.1} floors is left \
         all the same. Is it the right rig? If its parameters are right, something is missing that is not in the catalogue.",
        spec.name,
        names.join(", "),
        left(stage)
    ))
}
