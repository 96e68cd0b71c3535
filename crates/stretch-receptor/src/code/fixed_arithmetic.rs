//! Fixed point: thousandths of the reference's unit, in 32 bits.

use stretch_core::{
    DesignError, Poly13,
    fixed::{FixedLine, FixedPoly13},
};

use super::{
    arithmetic::{CodeArithmetic, sealed},
    code_map::{COARSE_BITS, CodeMap, Span},
    fold::Folded,
};

/// 32-bit fixed point; estimates are thousandths of the reference's unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fixed {}

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
    fn check(&self) -> Result<(), DesignError> {
        let holds = self.thousandths > 0;
        DesignError::check("fixed.thousandths", self.thousandths.into(), holds).map(|_| ())
    }

    /// Converts a value in units of `2^-bits` thousandths to thousandths. The half for rounding is already included.
    #[inline(always)]
    fn finish(&self, bits: i32) -> i32 {
        ((i64::from(bits) * i64::from(self.thousandths)) >> 32) as i32
    }
}

/// Numbers of fraction bits behind the thousandths that are tried. With more bits, the half for rounding would cost
/// more range than the bits gain in precision. With fewer bits, the factor `2^(32 - bits)` would not fit an `i32`.
const BITS: core::ops::RangeInclusive<u8> = 2..=16;

impl CodeArithmetic for Fixed {}
impl sealed::Arithmetic for Fixed {
    type Line = Scaled<FixedLine>;
    type Surface = Scaled<FixedPoly13>;
    type Estimate = i32;

    /// Rounds the surfaces with the largest number of fraction bits that fits.
    fn round(folded: &Folded) -> Result<CodeMap<Self::Line, Self::Surface>, DesignError> {
        let mut refused = DesignError::OutOfRange { field: "fixed.bits", value: 0.0 };
        for bits in BITS.rev() {
            match fixed_with(folded, bits) {
                Ok(surfaces) => return Ok(surfaces),
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }

    fn worst_case(
        surfaces: &CodeMap<Self::Line, Self::Surface>,
        rate_rounding: f64,
    ) -> Option<f64> {
        Some(worst_case(surfaces, rate_rounding))
    }

    fn line_over(line: Self::Line, _: &Span) -> Self::Line {
        line
    }
    fn surface_over(surface: Self::Surface, _: &Span, _: &Span) -> Self::Surface {
        surface
    }
    #[inline(always)]
    fn line(line: &Self::Line, signal: &Span, volts: i32) -> i32 {
        line.finish(line.of.eval(signal.spread(volts)))
    }
    #[inline(always)]
    fn surface(
        surface: &Self::Surface,
        (signal, volts): (&Span, i32),
        (rate_span, rate): (&Span, i32),
    ) -> i32 {
        surface.finish(surface.of.eval(rate_span.spread(rate), signal.spread(volts)))
    }
    fn valid_line(line: &Self::Line) -> Result<(), DesignError> {
        line.check()
    }
    fn valid_surface(surface: &Self::Surface) -> Result<(), DesignError> {
        surface.check()
    }
}

fn fixed_with(
    folded: &Folded,
    bits: u8,
) -> Result<CodeMap<Scaled<FixedLine>, Scaled<FixedPoly13>>, DesignError> {
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
pub(super) fn worst_case(
    surfaces: &CodeMap<Scaled<FixedLine>, Scaled<FixedPoly13>>,
    rate_rounding: f64,
) -> f64 {
    // an end of a domain is rounded to a whole number, which adds up to one to the rate's own rounding
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
