//! Every reading for a finite sample is finite, for every calibration that is accepted.

use proptest::{collection::vec, prelude::*, sample::Index};
use serde_json::{Value, json};
use stretch_core::{Calibration, Real, Runner, Volts};
use stretch_receptor::Receptor;

/// Numbers of all magnitudes that a float can have, and the bounds of the checks.
fn number() -> impl Strategy<Value = f64> {
    let power = prop_oneof![-12.0..12.0, -40.0..40.0, -300.0..308.0f64];
    let bound = prop::sample::select(vec![0.0, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9, 1e12, 1e308]);
    (prop_oneof![power.prop_map(|p| 10f64.powf(p)), bound], any::<bool>())
        .prop_map(|(x, is_negative)| if is_negative { -x } else { x })
}

/// Collects the paths of the numbers in a serialised calibration, except those that do not enter a
/// reading.
fn numbers(value: &Value, path: String, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(path),
        Value::Array(all) => {
            all.iter().enumerate().for_each(|(i, v)| numbers(v, format!("{path}/{i}"), found));
        }
        Value::Object(all) => all
            .iter()
            .filter(|(key, _)| !matches!(key.as_str(), "schema" | "provenance" | "fit"))
            .for_each(|(key, v)| numbers(v, format!("{path}/{key}"), found)),
        _ => {}
    }
}

/// A calibration of any kind with some of its numbers replaced; `None` if it is no longer valid.
fn spoilt() -> impl Strategy<Value = Option<Calibration>> {
    // either a number is scaled or replaced, or all signals are scaled together, as if the unit had changed
    let change = (any::<Index>(), number(), any::<bool>());
    (stretch_strategies::calibration(), vec(change, 0..5), prop::option::of(-9i32..9)).prop_map(
        |(calibration, changes, units)| {
            let mut record = serde_json::to_value(calibration).unwrap();
            let mut paths = Vec::new();
            numbers(&record, String::new(), &mut paths);
            let mut put = |path: &str, new: &dyn Fn(f64) -> f64| {
                let place = record.pointer_mut(path).unwrap();
                let before = place.as_f64().unwrap_or(0.0);
                // counts stay whole numbers
                if place.is_f64() {
                    *place = json!(new(before));
                }
            };
            for path in paths.iter().filter(|_| units.is_some()) {
                let is_signal = ["signal", "curve", "rate_range", "rate_domain", "noise", "level"]
                    .iter()
                    .any(|part| path.contains(part));
                if is_signal {
                    put(path, &|x| x * 10f64.powi(units.unwrap_or(0)));
                }
            }
            for (place, number, is_scale) in &changes {
                let path = &paths[place.index(paths.len())];
                put(path, &|x| if *is_scale { x * number } else { *number });
            }
            serde_json::from_value(record).ok()
        },
    )
}

/// A sample of a stream: a share of the calibrated range (`true`), or any number (`false`).
fn sample() -> impl Strategy<Value = (bool, f64)> {
    prop_oneof![
        6 => (-0.2..1.2).prop_map(|share| (true, share)),
        1 => Just((true, 0.0)),
        1 => Just((true, 1.0)),
        3 => number().prop_map(|x| (false, x)),
        1 => prop::sample::select(vec![1e18, -1e18, 9.9e17, 1e-45, f64::NAN, 0.0])
            .prop_map(|x| (false, x)),
    ]
}

fn stays_finite<T: Real>(
    calibration: &Calibration,
    stream: &[(bool, f64)],
) -> Result<bool, TestCaseError> {
    let Ok(receptor) = Receptor::<T>::new(calibration) else { return Ok(false) };
    let mut receptor = Runner::new(receptor);
    let range = calibration.spec().signal_range;
    for (nth, &(is_share, x)) in stream.iter().enumerate() {
        let volts = if is_share { range.min() + x * range.span() } else { x };
        if let Ok(reading) = receptor.step(Volts(T::from_f64(volts))) {
            let sd = reading.sd.map_or(0.0, Real::as_f64);
            let all = [reading.estimate.as_f64(), reading.rate.as_f64(), sd];
            prop_assert!(all.iter().all(|x| x.is_finite()), "sample {nth}, {volts}: {all:?}");
        }
    }
    Ok(true)
}

proptest! {
    // the variable PROPTEST_CASES sets a larger number
    #![proptest_config(ProptestConfig::with_cases(ProptestConfig::default().cases.max(4000)))]

    #[test]
    fn every_reading_of_an_accepted_record_is_finite(
        calibration in spoilt(), stream in vec(sample(), 1..200),
    ) {
        let Some(calibration) = calibration else { return Ok(()) };
        stays_finite::<f64>(&calibration, &stream)?;
        stays_finite::<f32>(&calibration, &stream)?;
    }
}
