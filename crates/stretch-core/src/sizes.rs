//! What sizes the numbers of a record may have, so that no finite sample gives a reading that is none.
//!
//! A board computes in `f32`, which ends at 3.4e38, and an estimator takes samples up to 1e18 at up
//! to 1e7 a second: a rate of 2e25. What is multiplied with that must stay below 1e11 to leave a
//! hundred over; what is not, below 1e30. Numbers with a unit may be up to 1e9 and what is divided
//! by down to 1e-9: a record in nanometres and microvolts fits.

use crate::{DesignError, Range};

/// The largest number with a unit, and the largest that has none.
pub const MOST: f64 = 1e9;
/// The least that is divided by.
pub const LEAST: f64 = 1e-9;
/// The largest product on the way to an estimate.
pub(crate) const MOST_PRODUCT: f64 = 1e30;
/// The largest change of the reference per change of the signal.
pub const MOST_SLOPE: f64 = 1e11;
/// The least and the most samples a second.
pub const RATES_HZ: core::ops::RangeInclusive<f64> = 1e-3..=1e7;

/// A number of a size that can be computed with.
///
/// # Errors
/// [`DesignError`] that names the field.
pub fn size(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, x.abs() <= MOST)
}

/// A number above zero that can be divided by.
///
/// # Errors
/// [`DesignError`] that names the field.
pub fn extent(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, (LEAST..=MOST).contains(&x))
}

/// Checks that neighbours on a curve differ in `f32`, because their difference is a divisor.
pub(crate) fn apart(field: &'static str, pair: &[f64]) -> Result<f64, DesignError> {
    let step = pair[1] - pair[0];
    DesignError::check(field, step, step.abs() >= LEAST && pair[1] as f32 != pair[0] as f32)
}

/// A range with a unit, whose two names are its own and its span's.
pub(crate) fn range(fields: [&'static str; 2], range: &Range) -> Result<(), DesignError> {
    for x in [range.min(), range.max(), range.offset()] {
        size(fields[0], x)?;
    }
    extent(fields[1], range.span()).map(|_| ())
}
