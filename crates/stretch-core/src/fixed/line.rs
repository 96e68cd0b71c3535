//! A straight line in fixed point.

use super::{
    accumulator::{Accumulator, check_horner},
    from_f64,
};
use crate::DesignError;

/// A line `intercept + slope v` over an input `v = volts / 2^32` in -1/2..1/2. `volts` may be any
/// `i32`.
///
/// Coefficients and result are in units of the output's least bit, which the caller chooses.
///
/// ```
/// use stretch_core::fixed::FixedLine;
/// let line = FixedLine::new(1000.0, 4000.0)?;
/// assert_eq!(line.eval(1 << 30), 2000); // 1000 + 4000 / 4
/// assert_eq!(line.eval(i32::MIN), -1000);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "(i32, i32)", into = "(i32, i32)"))]
pub struct FixedLine {
    intercept: i32,
    slope: i32,
}

impl FixedLine {
    /// The largest error of [`eval`](Self::eval) against the same line in real
    /// numbers, in least bits: two rounded coefficients and one rounded product.
    pub const ROUNDING: f64 = 0.5 + 0.25 + 0.5;

    /// Creates the line with these coefficients, rounded.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] if the result for some `i32` input would not fit 32 bits.
    pub fn new(intercept: f64, slope: f64) -> Result<Self, DesignError> {
        let round = |x| from_f64("fixed.line", x, 0);
        Self::try_from((round(intercept)?, round(slope)?))
    }

    /// Evaluates the line at `volts / 2^32`, in least bits.
    #[inline(always)]
    #[must_use]
    pub fn eval(&self, volts: i32) -> i32 {
        Accumulator::new(self.intercept).plus(self.slope, volts).value()
    }
}

impl TryFrom<(i32, i32)> for FixedLine {
    type Error = DesignError;
    fn try_from((intercept, slope): (i32, i32)) -> Result<Self, DesignError> {
        check_horner("fixed.line", &[intercept, slope].map(i32::unsigned_abs))?;
        Ok(Self { intercept, slope })
    }
}

impl From<FixedLine> for (i32, i32) {
    fn from(line: FixedLine) -> Self {
        (line.intercept, line.slope)
    }
}
