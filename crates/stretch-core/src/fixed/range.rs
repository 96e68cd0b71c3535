//! Normalisation in fixed point.

use super::{from_f64, saturate};
use crate::{DesignError, Range};

/// The affine relation between a channel's integers and its unit: `zero + step x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeUnits {
    /// Value of the channel at the integer 0.
    pub zero: f64,
    /// Change of the channel per step of the integer, above zero.
    pub step: f64,
}

/// Conversion between a channel's integers and normalised Q27 numbers over a [`Range`], with saturation.
///
/// ```text
/// normalise:    n = (x - offset) / span       x integer, n in Q27 (-16..16)
/// denormalise:  x = offset + n span
/// ```
///
/// A result outside 32 bits becomes the nearest `i32`.
///
/// ```
/// use stretch_core::{Normalisation, Range, RangeSpec, fixed::{FixedRange, RangeUnits}};
/// let volts = Range::new(RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min: 1.24, max: 2.24 })?;
/// // a 12-bit converter of 3.3 V
/// let range = FixedRange::new(&volts, RangeUnits { zero: 0.0, step: 3.3 / 4095.0 })?;
/// let n = f64::from(range.normalise(2048)) / f64::from(1 << 27);
/// approx::assert_abs_diff_eq!(n, 2048.0 * 3.3 / 4095.0 - 1.24, epsilon = 1e-8);
/// assert_eq!(range.denormalise(range.normalise(2048)), 2048);
/// assert_eq!(range.normalise(i32::MAX), i32::MAX); // saturated
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedRange {
    /// The offset in whole steps; `rest` is the negative remainder, normalised, in Q27.
    offset: i32,
    rest: i32,
    gain: Scale,
    inverse: Scale,
    /// Remainder of the offset, in 2^-16 steps.
    inverse_rest: i32,
}

/// A factor `mantissa / 2^shift` with 30 significant bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Scale {
    mantissa: i32,
    shift: u32,
}

impl Scale {
    fn new(field: &'static str, factor: f64) -> Result<Self, DesignError> {
        let (_, exponent) = libm::frexp(factor);
        let shift = 30 - exponent;
        // accepts factors from 2^-33 to below 2^29: with a smaller factor every product rounds to 0, with a larger
        // factor nearly every product exceeds 32 bits
        DesignError::check(field, factor, factor > 0.0 && (1..=62).contains(&shift))?;
        let shift = shift as u32;
        Ok(Self { mantissa: from_f64(field, factor, shift)?, shift })
    }

    /// Returns `x factor + extra`, rounded and saturated.
    #[inline]
    fn apply(self, x: i32, extra: i32) -> i32 {
        // at most 2^61 + 2^61: no overflow
        let product = i64::from(x) * i64::from(self.mantissa) + (1 << (self.shift - 1));
        saturate((product >> self.shift) + i64::from(extra))
    }
}

impl FixedRange {
    /// Converts a range for a channel whose integers have the scale `units`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] if the offset or the span does not fit 32 bits in these units.
    pub fn new(range: &Range, units: RangeUnits) -> Result<Self, DesignError> {
        const FIELD: &str = "fixed.range";
        DesignError::check("fixed.range.step", units.step, units.step > 0.0)?;
        DesignError::check("fixed.range.zero", units.zero, true)?;
        let offset = (range.offset() - units.zero) / units.step;
        let whole = from_f64(FIELD, libm::round(offset), 0)?;
        let fraction = offset - f64::from(whole);
        let per_step = units.step / range.span();
        Ok(Self {
            offset: whole,
            rest: from_f64(FIELD, -fraction * per_step, 27)?,
            gain: Scale::new(FIELD, libm::ldexp(per_step, 27))?,
            inverse: Scale::new(FIELD, libm::ldexp(per_step.recip(), -27 + 16))?,
            inverse_rest: from_f64(FIELD, fraction, 16)?,
        })
    }

    /// Returns `(x - offset)/span` in Q27.
    #[inline]
    #[must_use]
    pub fn normalise(&self, x: i32) -> i32 {
        self.gain.apply(x.saturating_sub(self.offset), self.rest)
    }

    /// Returns `offset + n span` in steps, for `n` in Q27.
    #[inline]
    #[must_use]
    pub fn denormalise(&self, n: i32) -> i32 {
        let product = i64::from(n) * i64::from(self.inverse.mantissa);
        // sixteen fractional bits are kept until the remainder of the offset is added
        let fine = (product >> self.inverse.shift) + i64::from(self.inverse_rest);
        saturate(((fine + (1 << 15)) >> 16) + i64::from(self.offset))
    }
}
