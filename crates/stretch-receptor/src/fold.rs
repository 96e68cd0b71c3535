//! Numbers that every receptor derives from a calibration.

use stretch_core::{Calibration, Range, Real};
use stretch_filter::{NamedRate, RateFilter};

use crate::ReceptorError;

/// Returns the reference units per unit of normalised target, and the reference at a target of zero.
pub(crate) fn output(calibration: &Calibration) -> (f64, f64) {
    let range: Range = calibration.spec().target_range;
    let target = calibration.spec().target;
    (target.reference_per_normalised(range), target.to_reference(range.offset()))
}

/// Returns the dead band as a rate of the reference, converted by the ratio of the two ranges.
pub(crate) fn reference_dead_band(calibration: &Calibration) -> f64 {
    let (gain, _) = output(calibration);
    calibration.spec().dead_band * (gain / calibration.spec().signal_range.span()).abs()
}

/// The rate estimator that a calibration names.
pub(crate) fn estimator<T: Real>(
    calibration: &Calibration,
) -> Result<RateFilter<T>, ReceptorError> {
    Ok(RateFilter::new(calibration.spec().rate_estimator, calibration.spec().sample_rate_hz)?)
}

/// Refuses a rate estimator that is not the one with which the calibration was fitted.
pub(crate) fn check_rate(
    calibration: &Calibration,
    rate: &impl NamedRate,
) -> Result<(), ReceptorError> {
    let fitted = (calibration.spec().rate_estimator, calibration.spec().sample_rate_hz);
    match rate.named() {
        Some(given) if given != fitted => Err(ReceptorError::Rate),
        _ => Ok(()),
    }
}

/// Converts values to the receptor's precision, and fills up with zeros.
pub fn rounded<T: Real, const N: usize>(values: impl Iterator<Item = f64>) -> [T; N] {
    let mut out = [T::zero(); N];
    for (place, value) in out.iter_mut().zip(values) {
        *place = T::from_f64(value);
    }
    out
}

/// Limits the number x to low .. high; returns low if x is not a number.
///
/// The function uses two comparisons, because `max` and `min` are calls on a board without such instructions.
#[inline(always)]
pub fn held<T: Real>(x: T, low: T, high: T) -> T {
    let x = greater(x, low);
    if x < high { x } else { high }
}

/// Returns the greater number; the second if the first is not a number.
#[inline(always)]
pub(crate) fn greater<T: Real>(x: T, y: T) -> T {
    if x > y { x } else { y }
}
