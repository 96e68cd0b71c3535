//! Any record on any small log, evenly sampled or not: `apply` and `evaluate` refuse or give finite numbers.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_calibrate::{apply, evaluate};
use stretch_core::Calibration;
use stretch_fuzz::trial;

fuzz_target!(|bytes: &[u8]| {
    let Ok((calibration, stream)) = postcard::take_from_bytes::<Calibration>(bytes) else { return };
    let (signal, target) = (calibration.signal_range, calibration.target_range);
    let columns = [
        (calibration.signal.as_str(), signal.min(), signal.max()),
        (calibration.reference.as_str(), target.min(), target.max()),
        ("pressure_kpa", 0.0, 400.0),
    ];
    let trial = trial(stream, &columns, 400);
    if let Ok(applied) = apply(&calibration, &trial) {
        assert_eq!(applied.readings.len(), trial.len());
        for reading in applied.readings.into_iter().flatten() {
            assert!(reading.estimate.is_finite() && reading.rate.is_finite(), "{reading:?}");
        }
    }
    if let Ok(evaluation) = evaluate(&[("fuzz", &calibration)], &[trial]) {
        assert!(evaluation.pooled.iter().all(|errors| !errors.rmse.is_nan()));
    }
});
