//! Conversion to 32-bit integers.

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
