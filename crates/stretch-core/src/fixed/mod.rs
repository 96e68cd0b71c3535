//! Fixed-point arithmetic with 32-bit numbers and 64-bit products, in which nothing can overflow.
//!
//! Two formats are used, both carried by a plain `i32`:
//!
//! | format | value of the integer `n` | where |
//! | --- | --- | --- |
//! | Q27 | `n / 2^27`, from -16 to 16 | [`FixedRange`]: normalised channels with headroom |
//! | half | `n / 2^32`, from -1/2 to 1/2 | inputs of [`FixedPoly13`] and [`FixedLine`] |
//!
//! In the format "half" the product is the upper word of a 64-bit product. A step of Horner's rule is therefore one
//! multiply-accumulate (`SMLAL`) without a shift.
//!
//! Integer arithmetic gives the same bits on every processor. Designs are computed in `f64`, and refused if they do not
//! fit ([`DesignError::OutOfRange`]). A step takes any `i32` and never panics or wraps.

mod accumulator;
mod line;
mod poly13;
mod range;

pub use line::FixedLine;
pub use poly13::FixedPoly13;
pub use range::{FixedRange, RangeUnits};

use crate::DesignError;

/// Returns `x 2^bits`, rounded to the nearest integer (halves away from zero).
///
/// # Errors
/// [`DesignError::OutOfRange`], naming `field`, for a value that is not finite
/// or does not fit 32 bits.
///
/// ```
/// use stretch_core::fixed::from_f64;
/// assert_eq!(from_f64("gain", 0.75, 2), Ok(3));
/// assert!(from_f64("gain", 16.0, 27).is_err());
/// ```
pub fn from_f64(field: &'static str, x: f64, bits: u32) -> Result<i32, DesignError> {
    let scaled = libm::round(libm::ldexp(x, bits as i32));
    let fits = scaled >= f64::from(i32::MIN) && scaled <= f64::from(i32::MAX);
    if fits { Ok(scaled as i32) } else { Err(DesignError::OutOfRange { field, value: x }) }
}

/// Returns the nearest 32-bit value.
///
/// ```
/// assert_eq!(stretch_core::fixed::saturate(1 << 40), i32::MAX);
/// ```
#[inline]
#[must_use]
pub fn saturate(x: i64) -> i32 {
    x.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}
