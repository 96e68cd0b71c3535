//! A log that is read block by block gives the calibration that the whole log gives, but for what the blocks' seams cost.

use proptest::prelude::*;
use stretch_calibrate::{
    CalibrateError, Calibrated, ModelKind, Options, calibrate, calibrate_long, evaluate,
    without_gross_errors,
};
use stretch_core::{Normalisation, RateSource, Turns};
use stretch_data::{Channel, Trial};

/// Up and down at several speeds, with the noise of a converter; every `placeholder`-th length is the placeholder of a recorder.
fn log(name: &str, count: usize, placeholder: usize) -> Trial {
    let mut seed = 1u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 40) as f64 / (1u64 << 24) as f64 - 0.5
    };
    let time_s: Vec<f64> = (0..count).map(|n| 0.01 * n as f64).collect();
    let length = |t: f64| 165.0 + 10.0 * (0.9 * t).sin() + 4.0 * (0.23 * t).cos();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let bridge_v =
        time_s.iter().map(|&t| 1.24 + 0.03 * (180.0 - length(t - 0.02)) + 1e-3 * noise());
    let channels = vec![channel("bridge_v", bridge_v.collect())];
    let mut trial = Trial { name: name.into(), time_s, channels };
    let length_mm = trial.time_s.iter().enumerate();
    let length_mm = length_mm
        .map(|(n, &t)| if placeholder > 0 && n % placeholder == 7 { -999.0 } else { length(t) });
    trial.channels.push(channel("length_mm", length_mm.collect()));
    trial
}

fn part(trial: &Trial, from: usize, to: usize) -> Trial {
    let cut = |values: &[f64]| values[from..to.min(values.len())].to_vec();
    let channel = |c: &Channel| Channel { name: c.name.clone(), values: cut(&c.values) };
    Trial {
        name: trial.name.clone(),
        time_s: cut(&trial.time_s),
        channels: trial.channels.iter().map(channel).collect(),
    }
}

fn in_blocks(
    trials: &[Trial],
    rows: usize,
    options: &Options,
) -> Result<Calibrated, CalibrateError> {
    let names: Vec<String> = trials.iter().map(|trial| trial.name.clone()).collect();
    let pass = |take: &mut dyn FnMut(usize, Trial) -> Result<(), CalibrateError>| {
        for (i, trial) in trials.iter().enumerate() {
            for from in (0..trial.len()).step_by(rows) {
                take(i, part(trial, from, from + rows))?;
            }
        }
        Ok(())
    };
    calibrate_long(&names, &pass, options)
}

/// By how much two calibrations differ in what they err on a log, as a share of it.
fn apart(a: &Calibrated, b: &Calibrated, log: &Trial) -> f64 {
    let both = [("a", &a.calibration), ("b", &b.calibration)];
    let errors = evaluate(&both, std::slice::from_ref(log)).unwrap().pooled;
    (errors[1].rmse / errors[2].rmse - 1.0).abs()
}

#[test]
fn blocks_give_what_the_whole_gives() {
    let trial = log("a", 12_000, 0);
    for (model, normalisation, rate_source) in [
        ("linear", Normalisation::Range, RateSource::Voltage),
        ("poly13", Normalisation::Range, RateSource::Voltage),
        ("poly13", Normalisation::MinMax, RateSource::Strain),
        ("poly24", Normalisation::MinMax, RateSource::Voltage),
        ("blended", Normalisation::Range, RateSource::Voltage),
    ] {
        let model: ModelKind = model.parse().unwrap();
        let options = Options { model, normalisation, rate_source, ..Options::default() };
        let whole = calibrate(std::slice::from_ref(&trial), &options).unwrap();
        let long = in_blocks(std::slice::from_ref(&trial), 3000, &options).unwrap();
        assert_eq!(long.calibration.signal_range, whole.calibration.signal_range);
        assert_eq!(long.calibration.target_range, whole.calibration.target_range);
        assert_eq!(long.calibration.polarity, whole.calibration.polarity);
        assert_eq!(long.fits.len(), whole.fits.len());
        // ten samples of warm-up a block are left out of the fit
        for (long, whole) in long.fits.iter().zip(&whole.fits) {
            assert!(whole.samples - long.samples <= 40, "{model}");
            assert!((long.rmse - whole.rmse).abs() < 1e-3 * whole.rmse, "{model}");
            assert_eq!(long.orders.len(), whole.orders.len());
        }
        let apart = apart(&long, &whole, &trial);
        assert!(apart < 0.01, "{model} {rate_source:?}: {apart}");
        assert!(long.notes.iter().any(|note| note.contains("block by block")));
    }
}

#[test]
fn one_block_gives_the_same_bits() {
    let trial = log("a", 6000, 0);
    let whole = calibrate(std::slice::from_ref(&trial), &Options::default()).unwrap();
    let long = in_blocks(std::slice::from_ref(&trial), 6000, &Options::default()).unwrap();
    assert!(whole.calibration.turns.is_some());
    assert_eq!(long.calibration, whole.calibration);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// A movement may begin in one block and end in the next; a gap and another trial begin anew, as they do in the whole.
    #[test]
    fn movements_of_blocks_are_those_of_the_whole_bit_for_bit(
        rows in 120usize..2500, gap in any::<bool>(), another in any::<bool>(),
    ) {
        let mut trials = vec![log("a", 12_000, 0)];
        if gap {
            // between two blocks, where one read sees it as well
            let at = 6000 / rows * rows;
            trials[0].time_s[at..].iter_mut().for_each(|t| *t += 7.0);
        }
        if another {
            trials.push(log("b", 6000, 0));
        }
        // rows at the end that are no block are left out
        for trial in &mut trials {
            let whole = trial.len() / rows * rows;
            trial.time_s.truncate(whole);
            trial.channels.iter_mut().for_each(|c| c.values.truncate(whole));
        }
        let options = Options { model: ModelKind::Linear, ..Options::default() };
        let whole = calibrate(&trials, &options).unwrap().calibration.turns.unwrap();
        let blocks = in_blocks(&trials, rows, &options).unwrap().calibration.turns.unwrap();
        let slope = whole.reference_per_signal;
        prop_assert!((blocks.reference_per_signal / slope - 1.0).abs() < 1e-9, "another fit");
        prop_assert_eq!(Turns { reference_per_signal: slope, ..blocks }, whole);
    }
}

/// A handful of rows at the end, a sample among them lost, say another rate: they are left out and counted.
#[test]
fn the_rest_of_a_log_may_be_too_short_to_be_a_block() {
    let mut trial = log("a", 6006, 0);
    trial.time_s.remove(6002);
    for channel in &mut trial.channels {
        channel.values.remove(6002);
    }
    let long = in_blocks(std::slice::from_ref(&trial), 2000, &Options::default()).unwrap();
    let said = "rows: 6000 of 6005 used, 5 left out";
    assert!(long.notes.iter().any(|note| note.contains(said)), "{:?}", long.notes);
}

#[test]
fn gross_errors_and_several_trials_are_reported_as_for_the_whole() {
    let trials = [log("a", 9000, 500), log("b", 7000, 0), log("c", 8001, 900)];
    let (kept, sentences) = without_gross_errors(&trials, &["length_mm", "bridge_v"]);
    let whole = calibrate(&kept, &Options::default()).unwrap();
    let long = in_blocks(&trials, 2000, &Options::default()).unwrap();
    assert_eq!(long.notes[0], sentences[0]);
    assert_eq!(long.calibration.target_range, whole.calibration.target_range);
    assert_eq!(long.calibration.provenance, whole.calibration.provenance);
    assert!(apart(&long, &whole, &kept[1]) < 0.05);
}

#[test]
fn what_needs_the_whole_log_is_refused() {
    let trial = log("a", 2000, 0);
    let observer = Options { model: "observer".parse().unwrap(), ..Options::default() };
    for options in [observer, Options::paper()] {
        let refused = in_blocks(std::slice::from_ref(&trial), 500, &options).unwrap_err();
        assert!(refused.to_string().contains("--model poly13"), "{refused}");
    }
    // a column that is not there is said as everywhere
    let missing = Options { signal: "bridge_V".into(), ..Options::default() };
    let said = in_blocks(std::slice::from_ref(&trial), 500, &missing).unwrap_err();
    assert!(said.to_string().contains("there is no column bridge_V"), "{said}");
}
