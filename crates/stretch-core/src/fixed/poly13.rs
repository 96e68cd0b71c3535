//! The surface of the published method ("the paper") in fixed point.

use super::{
    accumulator::{Accumulator, check_horner},
    from_f64,
};
use crate::{DesignError, Poly13};

/// A [`Poly13`] over two inputs in -1/2..1/2. The integers `rate` and `volts` may be any `i32`.
///
/// ```text
/// r = rate / 2^32,  v = volts / 2^32
/// p00 + p10 r + p01 v + p11 r v + p02 v^2 + p12 r v^2 + p03 v^3
/// ```
///
/// Coefficients and result are in units of the output's least bit, which the caller chooses.
/// Construction fails if any intermediate sum could exceed 32 bits for some pair of inputs.
/// Therefore [`eval`](Self::eval) needs no saturation, only six multiply-accumulates.
///
/// ```
/// use stretch_core::{Poly13, fixed::FixedPoly13};
/// let surface = Poly13 { p00: 1e6, p10: 8e5, p01: -4e5, p02: 3e5, ..Poly13::default() };
/// let fixed = FixedPoly13::new(&surface)?;
/// let (rate, volts) = (1 << 30, -(1 << 29)); // 0.25 and -0.125
/// let error = f64::from(fixed.eval(rate, volts)) - surface.eval(0.25, -0.125);
/// approx::assert_abs_diff_eq!(error, 0.0, epsilon = FixedPoly13::ROUNDING);
/// let steep = Poly13 { p03: 1e10, ..surface };
/// assert!(FixedPoly13::new(&steep).is_err());
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[i32; 7]", into = "[i32; 7]"))]
pub struct FixedPoly13 {
    /// p11 p12, p10 p00, p02 p03, p01: in the order of use, so that few registers are needed at a time.
    ordered: [i32; 7],
}

/// Name of the field in errors.
const FIELD: &str = "fixed.surface";

impl FixedPoly13 {
    /// The largest error of [`eval`](Self::eval) against the same surface in real numbers, in
    /// least bits. Each of the seven coefficients is rounded by up to half a bit, and each of
    /// the six products by up to one bit. Every later product halves these errors, because its
    /// input is at most 1/2.
    pub const ROUNDING: f64 = {
        let at_rest = 0.5 * (1.0 + 0.5 + 0.25 + 0.125) + (1.0 + 0.5 + 0.25);
        let by_rate = 0.5 * (1.0 + 0.5 + 0.25) + (1.0 + 0.5);
        at_rest + 0.5 * by_rate + 1.0
    };

    /// Creates the surface with these coefficients, rounded.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] if an intermediate sum would exceed 32 bits for some pair of
    /// inputs, or if a coefficient is not finite.
    pub fn new(surface: &Poly13) -> Result<Self, DesignError> {
        let Poly13 { p00, p10, p01, p11, p02, p12, p03 } = *surface;
        let round = |x| from_f64(FIELD, x, 0);
        Self::try_from([
            round(p00)?,
            round(p10)?,
            round(p01)?,
            round(p11)?,
            round(p02)?,
            round(p12)?,
            round(p03)?,
        ])
    }

    /// Evaluates the surface at `rate / 2^32` and `volts / 2^32`, in least bits.
    #[inline(always)]
    #[must_use]
    pub fn eval(&self, rate: i32, volts: i32) -> i32 {
        let [p11, p12, p10, p00, p02, p03, p01] = self.ordered;
        let by_rate = Accumulator::new(p11).plus(p12, volts).times(volts, p10);
        let moving = by_rate.times(rate, p00);
        let cubic = Accumulator::from_parts(p02, moving.0 as u32).plus(p03, volts);
        let at_rest = cubic.times(volts, p01);
        moving.carrying(at_rest).plus(at_rest.value(), volts).value()
    }

    /// Returns the rounded coefficients.
    #[must_use]
    pub fn coefficients(&self) -> Poly13 {
        let [p11, p12, p10, p00, p02, p03, p01] = self.ordered.map(f64::from);
        Poly13 { p00, p10, p01, p11, p02, p12, p03 }
    }
}

impl TryFrom<[i32; 7]> for FixedPoly13 {
    type Error = DesignError;
    /// Creates the surface from p00, p10, p01, p11, p02, p12, p03.
    fn try_from(coefficients: [i32; 7]) -> Result<Self, DesignError> {
        let [p00, p10, p01, p11, p02, p12, p03] = coefficients;
        let [a00, a10, a01, a11, a02, a12, a03] = coefficients.map(i32::unsigned_abs);
        let by_rate = check_horner(FIELD, &[a10, a11, a12])?;
        check_horner(FIELD, &[a00.saturating_add(by_rate.div_ceil(2)), a01, a02, a03])?;
        Ok(Self { ordered: [p11, p12, p10, p00, p02, p03, p01] })
    }
}

impl From<FixedPoly13> for [i32; 7] {
    fn from(surface: FixedPoly13) -> Self {
        let [p11, p12, p10, p00, p02, p03, p01] = surface.ordered;
        [p00, p10, p01, p11, p02, p12, p03]
    }
}
