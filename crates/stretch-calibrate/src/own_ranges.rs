//! A trial normalised by its own ranges, as in the paper.

use stretch_core::{Calibration, Interval, Model, Range, RangeSpec};
use stretch_data::Trial;

use crate::{
    CalibrateError,
    series::{extent, rates_at_use},
};

/// The same calibration with the ranges of one trial: the trial's signal and rate are divided by their own total
/// ranges, and nothing is clamped (paper section 2.5).
///
/// This function exists for comparison with the paper. A trial's ranges are known only at its end, so that such a
/// calibration cannot run live.
///
/// # Errors
/// [`CalibrateError::Data`] when the trial lacks the signal,
/// [`CalibrateError::Constant`] when the signal never changes.
///
/// ```
/// use stretch_calibrate::on_own_ranges;
/// use stretch_data::{Channel, Trial};
/// # let calibration = stretch_receptor::example_calibration();
/// let trial = Trial {
///     name: "short".into(),
///     time_s: (0..100).map(|n| n as f64 * 0.01).collect(),
///     channels: vec![Channel {
///         name: "bridge_v".into(),
///         values: (0..100).map(|n| 1.3 + 4e-5 * f64::from(n * n)).collect(),
///     }],
/// };
/// let own = on_own_ranges(&calibration, &trial)?;
/// approx::assert_abs_diff_eq!(own.signal_range.span(), 0.39204, epsilon = 1e-9);
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn on_own_ranges(
    calibration: &Calibration,
    trial: &Trial,
) -> Result<Calibration, CalibrateError> {
    let mut spec = calibration.clone().into_spec();
    let signal = trial.require(spec.signal.as_str())?;
    let rates = rates_at_use(spec.rate_estimator, spec.sample_rate_hz, signal)?;
    let signed = rates.iter().flatten().map(|rate| spec.polarity.sign() * rate);
    let (signal_extent, rate_extent) = (extent(signal.iter().copied()), extent(signed));
    let constant =
        || CalibrateError::Constant { column: spec.signal.to_string(), value: signal_extent.min };
    let range = |old: Range, seen: Interval| {
        Range::new(RangeSpec { min: seen.min, max: seen.max, ..old.into() }).map_err(|_| constant())
    };
    let signal_range = range(spec.signal_range, signal_extent)?;
    let mut model = spec.model;
    match &mut model {
        Model::Linear(line) => line.signal_domain = signal_extent,
        Model::Surfaces { inflation, deflation } => {
            for branch in [inflation, deflation] {
                branch.rate_range = range(branch.rate_range, rate_extent)?;
                branch.signal_domain = signal_extent;
                branch.rate_domain = rate_extent;
            }
        }
        // other models have no ranges that a trial could replace
        _ => {}
    }
    spec.signal_range = signal_range;
    spec.model = model;
    Ok(Calibration::new(spec)?)
}
