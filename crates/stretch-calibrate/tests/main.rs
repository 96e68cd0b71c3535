//! Tests of the public interface of stretch-calibrate, in one program because linking takes longer than most tests.

mod diagnosed;
mod doubts;
mod offset;
mod remembering;
mod seal;
mod wrapped;

use stretch_core::Calibration;

/// Returns a calibration as its file stores it: only JSON stores the checksums of trials.
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
