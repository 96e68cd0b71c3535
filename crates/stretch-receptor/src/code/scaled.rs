//! Fixed point: thousandths of the reference's unit, in 32 bits.

use stretch_core::{
    DesignError, Poly13,
    fixed::{FixedLine, FixedPoly13},
};

use super::{
    code_map::{COARSE_BITS, CodeMap, Span},
    fold::Folded,
};

/// One line for both branches, or a surface for each, in fixed point.
pub(super) type FixedMap = CodeMap<Scaled<FixedLine>, Scaled<FixedPoly13>>;

/// A fixed-point line or surface in units of `2^-bits` thousandths. Its constant term includes half a thousandth, so
/// that truncation rounds to the nearest thousandth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scaled<S> {
    /// The line or surface.
    pub of: S,
    /// The factor `2^(32 - bits)`: the upper word of a product with this factor is in thousandths.
    pub thousandths: i32,
}

impl<S> Scaled<S> {
    #[cfg(feature = "serde")]
    pub(super) fn check(&self) -> Result<(), DesignError> {
        let holds = self.thousandths > 0;
        DesignError::check("fixed.thousandths", self.thousandths.into(), holds).map(|_| ())
    }

    /// Converts a value in units of `2^-bits` thousandths to thousandths. The half for rounding is already included.
    #[inline(always)]
    fn finish(&self, bits: i32) -> i32 {
        ((i64::from(bits) * i64::from(self.thousandths)) >> 32) as i32
    }
}

/// Numbers of fraction bits that are tried; they follow the bit with the value of a thousandth. With more bits, adding
/// a half for rounding would cost more range than the bits gain in precision. With fewer bits, the factor `2^(32 -
/// bits)` would not fit an `i32`.
const BITS: core::ops::RangeInclusive<u8> = 2..=16;

impl Scaled<FixedLine> {
    /// Evaluates the line at a signal inside its span.
    #[inline(always)]
    pub(super) fn at(&self, signal: &Span, volts: i32) -> i32 {
        self.finish(self.of.eval(signal.spread(volts)))
    }
}

impl Scaled<FixedPoly13> {
    /// Evaluates the surface at a signal and a rate inside their spans.
    #[inline(always)]
    pub(super) fn at(&self, (signal, volts): (&Span, i32), (rate, r): (&Span, i32)) -> i32 {
        self.finish(self.of.eval(rate.spread(r), signal.spread(volts)))
    }
}

/// Rounds the surfaces with the largest number of fraction bits that fits.
pub(super) fn round(folded: &Folded) -> Result<FixedMap, DesignError> {
    let mut refused = DesignError::OutOfRange { field: "fixed.bits", value: 0.0 };
    for bits in BITS.rev() {
        match fixed_with(folded, bits) {
            Ok(surfaces) => return Ok(surfaces),
            Err(error) => refused = error,
        }
    }
    Err(refused)
}

fn fixed_with(folded: &Folded, bits: u8) -> Result<FixedMap, DesignError> {
    let scale = 1000.0 * f64::from(1u32 << bits);
    let half = 0.5 * f64::from(1u32 << bits);
    let thousandths = 1 << (32 - bits);
    folded.try_map(
        |&[intercept, slope]| {
            let of = FixedLine::new(intercept * scale + half, slope * scale)?;
            Ok(Scaled { of, thousandths })
        },
        |p| {
            let scaled = Poly13 {
                p00: p.p00 * scale + half,
                p10: p.p10 * scale,
                p01: p.p01 * scale,
                p11: p.p11 * scale,
                p02: p.p02 * scale,
                p12: p.p12 * scale,
                p03: p.p03 * scale,
            };
            Ok(Scaled { of: FixedPoly13::new(&scaled)?, thousandths })
        },
    )
}

/// Returns a bound on the difference between an estimate in fixed point and the same estimate in
/// real numbers, in thousandths of the reference's unit. If there are two surfaces, it is the larger
/// of their bounds. See
/// [`FixedCalibration::worst_case_error_um`](super::FixedCalibration::worst_case_error_um).
pub(super) fn worst_case(surfaces: &FixedMap, rate_rounding: f64) -> f64 {
    // an end of a domain is rounded to an integer, which adds up to one to the rounding error of the rate
    let spread = |factor: i32, rounding: f64| libm::ldexp(rounding * f64::from(factor), -32);
    let signal = |factor: i32| spread(factor, 1.0 + f64::from(1u32 << COARSE_BITS) * SIGNAL_F64);
    let bits =
        |error: f64, thousandths: i32| 0.5 + libm::ldexp(error * f64::from(thousandths), -32);
    match surfaces {
        CodeMap::Line(ranged) => {
            let (_, slope) = <(i32, i32)>::from(ranged.surface.of);
            let error = FixedLine::ROUNDING + f64::from(slope).abs() * signal(ranged.signal.factor);
            bits(error, ranged.surface.thousandths)
        }
        CodeMap::Poly13(both) => {
            let each = both.map(|ranged| {
                let p = ranged.surface.of.coefficients();
                // bounds on the slopes of the surface for inputs in -1/2 .. 1/2
                let by_rate = p.p10.abs() + 0.5 * p.p11.abs() + 0.25 * p.p12.abs();
                let by_signal = p.p01.abs()
                    + p.p02.abs()
                    + 0.75 * p.p03.abs()
                    + 0.5 * (p.p11.abs() + p.p12.abs());
                let error = FixedPoly13::ROUNDING
                    + by_rate * spread(ranged.rate.factor, 1.0 + rate_rounding)
                    + by_signal * signal(ranged.signal.factor);
                bits(error, ranged.surface.thousandths)
            });
            each[0].max(each[1])
        }
    }
}

/// Largest rounding error of `f64` in the position of a sample, in steps of a 16-bit sample.
const SIGNAL_F64: f64 = 1e-9;
