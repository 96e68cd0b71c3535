//! Floats over integers: for a board with a floating-point unit.

use stretch_core::{DesignError, Poly13, Real};

use super::{
    arithmetic::{CodeArithmetic, sealed},
    fold::Folded,
    sheet::Sheets,
};

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
