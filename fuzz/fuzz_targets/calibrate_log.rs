//! Any small log: `calibrate` refuses, or makes a calibration that answers its own log with finite numbers.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_calibrate::{ModelKind, Options, Robust, calibrate, evaluate, without_gross_errors};
use stretch_core::{Normalisation, RateEstimator};
use stretch_fuzz::{steps, trial};

/// Models that are fitted in a moment; those that search take shorter logs.
const QUICK: usize = 3;

fuzz_target!(|bytes: &[u8]| {
    let Some((&[model, how], stream)) = bytes.split_first_chunk::<2>() else { return };
    let kinds = ModelKind::named();
    // a model that searches costs a thousand of the others: one in 64
    let kind = match model {
        0..252 => kinds[usize::from(model) % QUICK],
        _ => kinds[QUICK + usize::from(how) % (kinds.len() - QUICK)],
    };
    let is_quick = model < 252;
    let base = if how & 1 == 0 { Options::default() } else { Options::paper() };
    let options = Options {
        model: kind,
        normalisation: [Normalisation::Range, Normalisation::MinMax][usize::from(how >> 1 & 1)],
        robust: [Robust::Off, Robust::Off, Robust::Bisquare, Robust::Lar]
            [usize::from(how >> 2 & 3)],
        rate: match how >> 4 & 3 {
            0 => RateEstimator::Differentiator { cutoff_hz: 8.0 },
            1 => RateEstimator::Tracker { tracking_index: 0.1 },
            _ => base.rate,
        },
        ..base
    };
    let columns = [("length_mm", 150.0, 180.0), ("bridge_v", 1.24, 2.1)];
    let most = if is_quick { 600 } else { 120 };
    let (first, second) =
        stream.split_at(if how & 64 == 0 { stream.len() } else { stream.len() / 2 });
    let mut trials = vec![trial(first, &columns, most)];
    if !second.is_empty() {
        trials.push(trial(second, &columns, most));
    }
    let (kept, _) = without_gross_errors(trials, &["length_mm", "bridge_v"]);
    let Ok(calibrated) = calibrate(&kept, &options) else { return };
    if let Ok(evaluation) = evaluate(&[("fuzz", &calibrated.calibration)], &kept) {
        assert!(evaluation.pooled.iter().all(|errors| errors.rmse.is_finite()));
    }
    steps::<f64>(&calibrated.calibration, stream);
});
