//! Any calibration on any small log, evenly sampled or not: `apply` and `evaluate` refuse or give finite numbers.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_calibrate::{apply, evaluate};
use stretch_core::Calibration;
use stretch_fuzz::trial;

fuzz_target!(|bytes: &[u8]| {
    let Ok((calibration, stream)) = postcard::take_from_bytes::<Calibration>(bytes) else { return };
    let (signal, target) = (calibration.spec().signal_range, calibration.spec().target_range);
    let columns = [
        (calibration.spec().signal.as_str(), signal.min(), signal.max()),
        (calibration.spec().reference.as_str(), target.min(), target.max()),
        ("pressure_kpa", 0.0, 400.0),
    ];
    let trial = trial(stream, &columns, 400);
    if let Ok(applied) = apply(&calibration, &trial) {
        assert_eq!(applied.readings.len(), trial.len());
        for reading in applied.readings.into_iter().flatten() {
            // a line or a curve answers before there is a rate
            let is_early = reading.rate.is_nan() && calibration.spec().model.needs_signal_only();
            let is_sound = reading.estimate.is_finite() && (reading.rate.is_finite() || is_early);
            assert!(is_sound, "{reading:?}");
        }
    }
    if let Ok(evaluation) = evaluate(&[("fuzz", &calibration)], &[trial]) {
        assert!(evaluation.pooled.iter().all(|errors| !errors.rmse.is_nan()));
    }
});
