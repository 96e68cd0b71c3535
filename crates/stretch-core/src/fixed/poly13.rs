//! The paper's surface in fixed point.

use super::{accumulate, check_horner, from_f64};
use crate::{DesignError, Poly13};

/// A [`Poly13`] over inputs in -1/2..1/2, for any two `i32`.
///
/// ```text
/// r = rate / 2^32,  v = volts / 2^32
/// p00 + p10 r + p01 v + p11 r v + p02 v^2 + p12 r v^2 + p03 v^3
/// ```
///
/// Coefficients and result are in units of the output's least bit, which the
/// caller chooses. A surface is only made when no pair of inputs can take any
/// intermediate sum out of 32 bits, so that [`eval`](Self::eval) needs no
/// saturation: six multiply-accumulates with rounding.
///
/// ```
/// use stretch_core::{Poly13, fixed::FixedPoly13};
/// let surface = Poly13 { p00: 1e6, p10: 8e5, p01: -4e5, p02: 3e5, ..Poly13::default() };
/// let fixed = FixedPoly13::new(&surface)?;
/// let (rate, volts) = (1 << 30, -(1 << 29)); // 0.25 and -0.125
/// let error = f64::from(fixed.eval(rate, volts)) - surface.eval(0.25, -0.125);
/// assert!(error.abs() <= FixedPoly13::ROUNDING);
/// let steep = Poly13 { p03: 1e10, ..surface };
/// assert!(FixedPoly13::new(&steep).is_err());
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[i32; 7]", into = "[i32; 7]"))]
pub struct FixedPoly13 {
    at_rest: [i32; 4],
    by_rate: [i32; 3],
}

impl FixedPoly13 {
    /// The largest error of [`eval`](Self::eval) against the same surface in
    /// real numbers, in least bits: each of the seven coefficients and of the
    /// six products is rounded by half a bit, and halved by every product behind it.
    pub const ROUNDING: f64 = {
        let at_rest = 0.5 * (1.0 + 0.5 + 0.25 + 0.125) + 0.5 * (1.0 + 0.5 + 0.25);
        let by_rate = 0.5 * (1.0 + 0.5 + 0.25) + 0.5 * (1.0 + 0.5);
        at_rest + 0.5 * by_rate + 0.5
    };

    /// The surface with these coefficients, rounded.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] when some pair of inputs would take an
    /// intermediate sum out of 32 bits, or a coefficient is not finite.
    pub fn new(surface: &Poly13) -> Result<Self, DesignError> {
        const FIELD: &str = "fixed.surface";
        let Poly13 { p00, p10, p01, p11, p02, p12, p03 } = *surface;
        check_horner(FIELD, &[p10, p11, p12])?;
        let by_rate = libm::fabs(p10) + 0.5 * libm::fabs(p11) + 0.25 * libm::fabs(p12);
        check_horner(FIELD, &[libm::fabs(p00) + 0.5 * by_rate, p01, p02, p03])?;
        let round = |x| from_f64(FIELD, x, 0);
        Ok(Self {
            at_rest: [round(p00)?, round(p01)?, round(p02)?, round(p03)?],
            by_rate: [round(p10)?, round(p11)?, round(p12)?],
        })
    }

    /// The surface at `rate / 2^32` and `volts / 2^32`, in least bits.
    #[inline(always)]
    #[must_use]
    pub fn eval(&self, rate: i32, volts: i32) -> i32 {
        let [p00, p01, p02, p03] = self.at_rest;
        let [p10, p11, p12] = self.by_rate;
        let by_rate = accumulate(p10, accumulate(p11, p12, volts), volts);
        let moving = accumulate(p00, by_rate, rate);
        accumulate(moving, accumulate(p01, accumulate(p02, p03, volts), volts), volts)
    }

    /// The rounded coefficients.
    #[must_use]
    pub fn coefficients(&self) -> Poly13 {
        let [p00, p01, p02, p03] = self.at_rest.map(f64::from);
        let [p10, p11, p12] = self.by_rate.map(f64::from);
        Poly13 { p00, p10, p01, p11, p02, p12, p03 }
    }
}

impl TryFrom<[i32; 7]> for FixedPoly13 {
    type Error = DesignError;
    /// From p00, p10, p01, p11, p02, p12, p03.
    fn try_from(coefficients: [i32; 7]) -> Result<Self, DesignError> {
        let [p00, p10, p01, p11, p02, p12, p03] = coefficients.map(f64::from);
        Self::new(&Poly13 { p00, p10, p01, p11, p02, p12, p03 })
    }
}

impl From<FixedPoly13> for [i32; 7] {
    fn from(surface: FixedPoly13) -> Self {
        let [p00, p01, p02, p03] = surface.at_rest;
        let [p10, p11, p12] = surface.by_rate;
        [p00, p10, p01, p11, p02, p12, p03]
    }
}
