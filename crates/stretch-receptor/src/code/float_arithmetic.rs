//! Surfaces in floating point over integer inputs, for boards with a floating-point unit.

use stretch_core::{DesignError, Poly13, Real};

use super::{
    arithmetic::{CodeArithmetic, sealed},
    code_map::{CodeMap, Span},
    fold::Folded,
};

macro_rules! float {
    ($($float:ty),*) => {$(
        impl CodeArithmetic for $float {}
        impl sealed::Arithmetic for $float {
            type Line = [$float; 2];
            type Surface = Poly13<$float>;
            type Estimate = $float;

            fn round(folded: &Folded) -> Result<CodeMap<[$float; 2], Poly13<$float>>, DesignError> {
                float(folded)
            }

            fn worst_case(_: &CodeMap<Self::Line, Self::Surface>, _: f64) -> Option<f64> {
                None
            }

            // the factor is a power of two, so multiplying the coefficients by it gives the same bits as multiplying
            // the inputs
            fn line_over([intercept, slope]: Self::Line, signal: &Span) -> Self::Line {
                [intercept, slope * signal.factor as $float]
            }
            fn surface_over(p: Self::Surface, signal: &Span, rate: &Span) -> Self::Surface {
                let (v, r) = (signal.factor as $float, rate.factor as $float);
                Poly13 {
                    p00: p.p00,
                    p10: p.p10 * r,
                    p01: p.p01 * v,
                    p11: p.p11 * r * v,
                    p02: p.p02 * v * v,
                    p12: p.p12 * r * v * v,
                    p03: p.p03 * v * v * v,
                }
            }
            #[inline(always)]
            fn line(&[intercept, slope]: &Self::Line, _: &Span, volts: i32) -> $float {
                intercept + slope * volts as $float
            }
            #[inline(always)]
            fn surface(
                surface: &Self::Surface,
                (_, volts): (&Span, i32),
                (_, rate): (&Span, i32),
            ) -> $float {
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
    // the limit keeps a coefficient times up to three inputs of 2^31, and sums of these, within the range of f32
    let check = |c: &T| DesignError::check("surface", c.as_f64(), c.abs().as_f64() <= 1e9);
    coefficients.iter().try_for_each(|c| check(c).map(|_| ()))
}

/// Rescales the coefficients from inputs in -1/2 .. 1/2 to inputs in 32-bit integers, and rounds them.
fn float<T: Real>(folded: &Folded) -> Result<CodeMap<[T; 2], Poly13<T>>, DesignError> {
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use sealed::Arithmetic;

    proptest! {
        #[test]
        fn a_factor_on_the_coefficients_gives_the_bits_of_one_on_the_inputs(
            p in proptest::array::uniform7(-300.0..300.0f64),
            ends in (1i32..1 << 30, 1i32..1 << 30),
            shares in (-1.0..1.0f64, -1.0..1.0f64),
        ) {
            let (signal, rate) = (Span::new(-ends.0, ends.0), Span::new(-ends.1, ends.1));
            let scaled = |c: f64, powers: i32| libm::ldexp(c, -32 * powers) as f32;
            let [p00, p10, p01, p11, p02, p12, p03] = p;
            let p = Poly13 {
                p00: p00 as f32,
                p10: scaled(p10, 1),
                p01: scaled(p01, 1),
                p11: scaled(p11, 2),
                p02: scaled(p02, 2),
                p12: scaled(p12, 3),
                p03: scaled(p03, 3),
            };
            let volts = (shares.0 * f64::from(ends.0)) as i32;
            let r = (shares.1 * f64::from(ends.1)) as i32;
            let over = f32::surface_over(p, &signal, &rate);
            let found = f32::surface(&over, (&signal, volts), (&rate, r));
            let spread = p.eval(rate.spread(r) as f32, signal.spread(volts) as f32);
            prop_assert_eq!(found.to_bits(), spread.to_bits());
            let line = [p.p00, p.p01];
            let found = f32::line(&f32::line_over(line, &signal), &signal, volts);
            let spread = line[0] + line[1] * signal.spread(volts) as f32;
            prop_assert_eq!(found.to_bits(), spread.to_bits());
        }
    }
}
