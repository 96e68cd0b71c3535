//! Numbers that every receptor folds out of a calibration.

use stretch_core::{Calibration, Range, Real};
use stretch_filter::RateFilter;

use crate::ReceptorError;

/// Reference units per normalised target, and the reference at a target of zero.
pub(crate) fn output(calibration: &Calibration) -> (f64, f64) {
    let range: Range = calibration.spec().target_range;
    let target = calibration.spec().target;
    (target.reference_per_target() * range.span(), target.to_reference(range.offset()))
}

/// The dead band as a rate of the reference, by the ratio of the two ranges.
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

/// Values in the receptor's precision, filled up with zeros.
pub fn rounded<T: Real, const N: usize>(values: impl Iterator<Item = f64>) -> [T; N] {
    let mut out = [T::zero(); N];
    for (place, value) in out.iter_mut().zip(values) {
        *place = T::from_f64(value);
    }
    out
}

/// The number x held to low .. high; low where x is not a number.
///
/// The function uses two comparisons, because `max` and `min` are calls on a board without such instructions.
#[inline(always)]
pub fn held<T: Real>(x: T, low: T, high: T) -> T {
    let x = greater(x, low);
    if x < high { x } else { high }
}

/// The greater of both; the second where the first is not a number.
#[inline(always)]
pub(crate) fn greater<T: Real>(x: T, y: T) -> T {
    if x > y { x } else { y }
}
