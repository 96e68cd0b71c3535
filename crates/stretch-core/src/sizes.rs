//! Limits on the numbers of a calibration, which ensure that no finite sample gives a non-finite reading.
//!
//! A microcontroller computes in `f32`, whose largest value is 3.4e38. Samples are at most 1e18 at up to 1e7 Hz, so a
//! rate is at most 2e25. A coefficient that multiplies a rate must be below 1e11, which leaves a margin of 100. Other
//! products must be below 1e30. Numbers with a unit are at most 1e9 and divisors at least 1e-9. Calibrations in
//! nanometres and microvolts are within these limits.

use crate::{DesignError, Interval, Range};

/// Largest magnitude of a number, with or without a unit.
pub const MOST: f64 = 1e9;
/// Smallest divisor.
pub const LEAST: f64 = 1e-9;
/// Largest intermediate product of an estimate.
pub(crate) const MOST_PRODUCT: f64 = 1e30;
/// Largest change of the reference per change of the signal.
pub const MOST_SLOPE: f64 = 1e11;
/// Range of sample rates, in hertz.
pub const RATES_HZ: core::ops::RangeInclusive<f64> = 1e-3..=1e7;

/// Checks that the magnitude of a number is at most `MOST`.
///
/// # Errors
/// [`DesignError`] that names the field.
pub fn size(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, x.abs() <= MOST)
}

/// Checks that a number is positive and can be a divisor: from `LEAST` to `MOST`.
///
/// # Errors
/// [`DesignError`] that names the field.
pub fn extent(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, (LEAST..=MOST).contains(&x))
}

/// Checks that a number is from 0 to `MOST`.
pub(crate) fn not_negative(field: &'static str, x: f64) -> Result<f64, DesignError> {
    DesignError::check(field, x, (0.0..=MOST).contains(&x))
}

/// Checks a curve: it has two knots or more, and always rises or always falls. Neighbouring knots differ in `f32`, because
/// their difference is a divisor. `fields` are the names of length, steps and knots in errors.
pub(crate) fn curve(fields: [&'static str; 3], knots: &[f64]) -> Result<(), DesignError> {
    let [length, steps, field] = fields;
    DesignError::check(length, knots.len() as f64, knots.len() >= 2)?;
    let rises = knots[knots.len() - 1] > knots[0];
    for pair in knots.windows(2) {
        let step = pair[1] - pair[0];
        let is_apart = step.abs() >= LEAST && pair[1] as f32 != pair[0] as f32;
        DesignError::check(steps, step, is_apart && (step > 0.0) == rises)?;
    }
    knots.iter().try_for_each(|&knot| size(field, knot).map(|_| ()))
}

/// Checks the sizes of an interval that can be divided by.
pub(crate) fn domain(field: &'static str, interval: Interval) -> Result<(), DesignError> {
    let Interval { min, max } = interval.validate(field)?;
    if min >= max {
        return Err(DesignError::EmptyRange { field, min, max });
    }
    size(field, min)?;
    size(field, max)?;
    extent(field, max - min).map(|_| ())
}

/// Checks the sizes of a range. `fields` are the names of the range and of its span in errors.
pub(crate) fn range(fields: [&'static str; 2], range: &Range) -> Result<(), DesignError> {
    for x in [range.min(), range.max(), range.offset()] {
        size(fields[0], x)?;
    }
    extent(fields[1], range.span()).map(|_| ())
}
