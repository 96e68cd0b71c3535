//! Is it the right simulator at all?

use crate::{
    diagnosis::{Diagnosis, VerdictKind},
    evidence::Evidence,
    frame::Role,
    simulator::Simulator,
};

/// Share of a channel's variance that may be left before names mean nothing.
const FOREIGN: f64 = 0.1;

/// Takes names back where the simulator, with the best effects, leaves more than a tenth of a channel's variance on
/// the test trials: that is another rig, or a column that is not what its name says.
pub(crate) fn check(simulator: &dyn Simulator, evidence: &Evidence, diagnosis: &mut Diagnosis) {
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
        if share > FOREIGN && worst.is_none_or(|w| share > w.1) {
            worst = Some((stage, share));
        }
    }
    let Some((stage, share)) = worst else { return };
    let spec = &simulator.stages()[stage];
    let sentence = format!(
        "The gap is everything: {:.0} % of what {} does is not in the simulator of {}. Is it the right rig, and is every \
         column what its name says?",
        100.0 * share.min(1.0),
        spec.channel,
        spec.name
    );
    if diagnosis.verdict != VerdictKind::Unknown || !diagnosis.named.is_empty() {
        diagnosis.notes.push(format!("before that was seen: {}", diagnosis.sentence));
    }
    diagnosis.verdict = VerdictKind::Unknown;
    diagnosis.named.clear();
    diagnosis.sentence = sentence;
}
