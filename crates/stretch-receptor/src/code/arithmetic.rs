//! What evaluates a surface: fixed point, or a float.

use stretch_core::{
    DesignError, Poly13, Real,
    fixed::{FixedLine, FixedPoly13},
};

use super::{
    fold::Folded,
    sheet::{Sheet, Sheets},
};

pub(super) mod sealed {
    use super::*;

    /// Lines and surfaces over spread integers.
    pub trait Arithmetic: Sized + Copy + core::fmt::Debug + PartialEq {
        type Line: Copy + core::fmt::Debug + PartialEq;
        type Surface: Copy + core::fmt::Debug + PartialEq;
        type Estimate: Copy + core::fmt::Debug + PartialEq;

        fn round(folded: &Folded) -> Result<Sheets<Self::Line, Self::Surface>, DesignError>;
        /// The largest error in thousandths; `None` where it is a float's own.
        fn worst_case(
            sheets: &Sheets<Self::Line, Self::Surface>,
            rate_rounding: f64,
        ) -> Option<f64>;
        fn line(line: &Self::Line, volts: i32) -> Self::Estimate;
        fn surface(surface: &Self::Surface, rate: i32, volts: i32) -> Self::Estimate;
        fn valid_line(line: &Self::Line) -> Result<(), DesignError>;
        fn valid_surface(surface: &Self::Surface) -> Result<(), DesignError>;
    }
}

/// The arithmetic that a [`CodeReceptor`](super::CodeReceptor) evaluates its
/// surface in: [`Fixed`], `f32` or `f64`.
pub trait CodeArithmetic: sealed::Arithmetic {}

/// 32-bit fixed point; estimates are thousandths of the reference's unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fixed {}

/// A fixed-point line or surface in `2^-bits` thousandths, half of one included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scaled<S> {
    pub(super) of: S,
    /// `2^(32 - bits)`: what the upper word of a product with it makes thousandths.
    pub(super) thousandths: i32,
}

impl<S> Scaled<S> {
    fn check(&self) -> Result<(), DesignError> {
        let holds = self.thousandths > 0;
        DesignError::check("fixed.thousandths", self.thousandths.into(), holds).map(|_| ())
    }

    /// Least bits to thousandths: the half is already in.
    #[inline(always)]
    fn finish(&self, bits: i32) -> i32 {
        ((i64::from(bits) * i64::from(self.thousandths)) >> 32) as i32
    }
}

/// Bits behind the thousandths: beyond these the half that rounds would cost more
/// range than it gains precision, and with fewer it would not fit.
const BITS: core::ops::RangeInclusive<u8> = 2..=16;

impl CodeArithmetic for Fixed {}
impl sealed::Arithmetic for Fixed {
    type Line = Scaled<FixedLine>;
    type Surface = Scaled<FixedPoly13>;
    type Estimate = i32;

    /// The finest thousandths in which everything fits.
    fn round(folded: &Folded) -> Result<Sheets<Self::Line, Self::Surface>, DesignError> {
        let mut refused = DesignError::OutOfRange { field: "fixed.bits", value: 0.0 };
        for bits in BITS.rev() {
            match fixed_with(folded, bits) {
                Ok(sheets) => return Ok(sheets),
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }

    fn worst_case(sheets: &Sheets<Self::Line, Self::Surface>, rate_rounding: f64) -> Option<f64> {
        Some(super::calibration::worst_case(sheets, rate_rounding))
    }

    #[inline(always)]
    fn line(line: &Self::Line, volts: i32) -> i32 {
        line.finish(line.of.eval(volts))
    }
    #[inline(always)]
    fn surface(surface: &Self::Surface, rate: i32, volts: i32) -> i32 {
        surface.finish(surface.of.eval(rate, volts))
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
) -> Result<Sheets<Scaled<FixedLine>, Scaled<FixedPoly13>>, DesignError> {
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

impl<L, P> Sheets<L, P> {
    pub(super) fn try_map<M, Q>(
        &self,
        line: impl Fn(&L) -> Result<M, DesignError>,
        surface: impl Fn(&P) -> Result<Q, DesignError>,
    ) -> Result<Sheets<M, Q>, DesignError> {
        fn with<S, T>(sheet: &Sheet<S>, surface: T) -> Sheet<T> {
            let Sheet { centre, signal, rate, .. } = *sheet;
            Sheet { centre, signal, rate, surface }
        }
        Ok(match self {
            Self::Line(sheet) => Sheets::Line(with(sheet, line(&sheet.surface)?)),
            Self::Poly13([up, down]) => Sheets::Poly13([
                with(up, surface(&up.surface)?),
                with(down, surface(&down.surface)?),
            ]),
        })
    }
}

macro_rules! float {
    ($($float:ty),*) => {$(
        impl CodeArithmetic for $float {}
        impl sealed::Arithmetic for $float {
            type Line = [$float; 2];
            type Surface = Poly13<$float>;
            type Estimate = $float;

            fn round(folded: &Folded) -> Result<Sheets<[$float; 2], Poly13<$float>>, DesignError> {
                float(folded)
            }

            fn worst_case(_: &Sheets<Self::Line, Self::Surface>, _: f64) -> Option<f64> {
                None
            }

            #[inline(always)]
            fn line(&[intercept, slope]: &Self::Line, volts: i32) -> $float {
                intercept + slope * volts as $float
            }
            #[inline(always)]
            fn surface(surface: &Self::Surface, rate: i32, volts: i32) -> $float {
                surface.eval(rate as $float, volts as $float)
            }
            fn valid_line(line: &Self::Line) -> Result<(), DesignError> {
                finite(line)
            }
            fn valid_surface(s: &Self::Surface) -> Result<(), DesignError> {
                finite(&[s.p00, s.p10, s.p01, s.p11, s.p02, s.p12, s.p03])
            }
        }
    )*};
}
float!(f32, f64);

fn finite<T: Real>(coefficients: &[T]) -> Result<(), DesignError> {
    // so that no sum of products of two 2^31 leaves the range of f32
    let check = |c: &T| DesignError::check("surface", c.as_f64(), c.abs().as_f64() <= 1e9);
    coefficients.iter().try_for_each(|c| check(c).map(|_| ()))
}

/// The coefficients over integers instead of halves, rounded.
fn float<T: Real>(folded: &Folded) -> Result<Sheets<[T; 2], Poly13<T>>, DesignError> {
    let round = |c: f64, powers: i32| T::from_f64(libm::ldexp(c, -32 * powers));
    folded.try_map(
        |&[intercept, slope]| Ok([round(intercept, 0), round(slope, 1)]),
        |p| {
            Ok(Poly13 {
                p00: round(p.p00, 0),
                p10: round(p.p10, 1),
                p01: round(p.p01, 1),
                p11: round(p.p11, 2),
                p02: round(p.p02, 2),
                p12: round(p.p12, 3),
                p03: round(p.p03, 3),
            })
        },
    )
}
