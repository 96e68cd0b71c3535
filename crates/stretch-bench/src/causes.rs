//! From a diagnosis to what a calibration can use of it.

use stretch_calibrate::Cause;
use stretch_gap::{Candidate, Diagnosis, VerdictKind};
use stretch_sim::{Gauge, Stage, effect_named};

/// The effects of the gauge and its reference in the best set of a diagnosis, with their values in shares of the reference's range:
/// those of the whole rig divided by its strokes, those of a gauge alone as they are. Empty where the simulator
/// is not short of any, and where the record is wrong.
///
/// A set that the verdict does not name is among them: whether it is of use a calibration finds out on trials left out.
pub fn causes(diagnosis: &Diagnosis) -> Vec<Cause> {
    use VerdictKind::{Effect, Partial, Unknown};
    let first: Option<&Candidate> = diagnosis.candidates.first();
    let Some(first) = first.filter(|_| matches!(diagnosis.verdict, Effect | Partial | Unknown))
    else {
        return Vec::new();
    };
    let is_alone = diagnosis.location.stages.len() == 1;
    let of_gauge = |name: &&String| {
        effect_named(name).is_some_and(|e| matches!(e.stage, Stage::Sensing | Stage::Reference))
    };
    let cause = |name: &String| {
        let own = first.parameters.iter().filter(|p| p.effect == *name);
        let parameters = effect_named(name).map_or(&[][..], |e| e.parameters);
        let unit = |parameter: &str| {
            let found = parameters.iter().find(|p| p.name == parameter);
            if is_alone { 1.0 } else { found.map_or(1.0, Gauge::unit) }
        };
        // A voltage's own zero is not told: where the rails lie a fit finds.
        let is_level = |parameter: &str| !is_alone && parameter.starts_with("v_");
        let told = own.filter(|p| !is_level(&p.name));
        let values = told.map(|p| (p.name.clone(), p.value * unit(&p.name))).collect();
        Cause { effect: name.clone(), values }
    };
    first.effects.iter().filter(of_gauge).map(cause).collect()
}
