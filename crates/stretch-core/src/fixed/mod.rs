//! Fixed point: 32-bit numbers, 64-bit products, and nothing that can overflow.
//!
//! Two formats are used, both carried by a plain `i32`:
//!
//! | format | value of the integer `n` | where |
//! | --- | --- | --- |
//! | Q27 | `n / 2^27`, from -16 to 16 | [`FixedRange`]: normalised channels with headroom |
//! | half | `n / 2^32`, from -1/2 to 1/2 | inputs of [`FixedPoly13`] and [`FixedLine`] |
//!
//! In the second one the upper word of a 64-bit product is the product, so that
//! a step of Horner's rule is one multiply-accumulate (`SMLAL`) and no shift.
//!
//! Integer arithmetic rounds the same way everywhere: results are the same bits
//! on a desk and on any core. Designs are computed in `f64` and refused when
//! they do not fit ([`DesignError::OutOfRange`]); a step takes any `i32` and
//! never panics or wraps.

mod line;
mod poly13;
mod range;

pub use line::FixedLine;
pub use poly13::FixedPoly13;
pub use range::{FixedRange, RangeUnits};

use crate::DesignError;

/// `x 2^bits`, rounded to the nearest integer (halves away from zero).
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

/// The nearest 32-bit value.
///
/// ```
/// assert_eq!(stretch_core::fixed::saturate(1 << 40), i32::MAX);
/// ```
#[inline]
#[must_use]
pub fn saturate(x: i64) -> i32 {
    x.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// A value in least bits and the fraction that its last product left, 32 bits each.
///
/// The fraction of one product is carried into the next instead of a half: that
/// costs no instruction and rounds by less than one least bit either way.
#[derive(Clone, Copy)]
struct Accumulator(u64);

impl Accumulator {
    /// `c` and a half, less 2^-32: a whole half would be taken for a rounding
    /// product (SMMLAR) on cores that have it, which drops the fraction.
    #[inline(always)]
    fn new(c: i32) -> Self {
        Self::from_parts(c, (1 << 31) - 1)
    }

    /// `c + self v / 2^32`, with what is left of it: one SMLAL. The sum is known to fit.
    #[inline(always)]
    fn times(self, v: i32, c: i32) -> Self {
        Self::from_parts(c, self.0 as u32).plus(self.value(), v)
    }

    /// `self + a v / 2^32`.
    #[inline(always)]
    fn plus(self, a: i32, v: i32) -> Self {
        Self(self.0.wrapping_add((i64::from(a) * i64::from(v)) as u64))
    }

    /// This value, with what another one left.
    #[inline(always)]
    fn carrying(self, other: Self) -> Self {
        Self::from_parts(self.value(), other.0 as u32)
    }

    #[inline(always)]
    fn from_parts(c: i32, rest: u32) -> Self {
        Self((u64::from(c as u32) << 32) | u64::from(rest))
    }

    #[inline(always)]
    fn value(self) -> i32 {
        (self.0 >> 32) as i32
    }
}

/// Checks that `|terms[0]| + |terms[1]|/2 + |terms[2]|/4 + ...`, and every tail
/// of that sum, stays inside 32 bits with room for the roundings; gives the sum.
fn check_horner(field: &'static str, terms: &[u32]) -> Result<u32, DesignError> {
    const MOST: u32 = i32::MAX as u32 - 8;
    let mut sum = 0u32;
    for &term in terms.iter().rev() {
        sum = sum.div_ceil(2).saturating_add(term);
        if sum > MOST {
            return Err(DesignError::OutOfRange { field, value: sum.into() });
        }
    }
    Ok(sum)
}
