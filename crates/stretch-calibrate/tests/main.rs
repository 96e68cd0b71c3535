//! The tests of stretch-calibrate from outside, one program: linking takes longer than most of them.

mod diagnosed;
mod doubts;
mod offset;
mod remembering;
mod seal;
mod wrapped;

use stretch_core::Calibration;

/// A calibration as its record holds it: only JSON holds the checksums of trials.
fn as_held(calibration: &Calibration, name: &str) -> Calibration {
    assert_eq!(
        calibration.spec().provenance.checksums().len(),
        calibration.spec().provenance.trial_count() as usize
    );
    if name.ends_with(".json") {
        return calibration.clone();
    }
    let mut spec = calibration.clone().into_spec();
    spec.provenance = spec.provenance.with_checksums([]);
    Calibration::new(spec).unwrap()
}
