//! Tests of fixed point against real numbers, at extreme and random inputs.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use proptest::prelude::*;
use stretch_core::{
    Poly13, Range,
    fixed::{FixedLine, FixedPoly13, FixedRange, RangeUnits, saturate},
};
use testkit::tolerance as tol;

/// Extreme inputs, at which errors of 32-bit arithmetic are most likely.
const CORNERS: [i32; 11] = [
    i32::MIN,
    i32::MIN + 1,
    -(1 << 30) - 1,
    -(1 << 16),
    -1,
    0,
    1,
    1 << 16,
    (1 << 30) + 1,
    i32::MAX - 1,
    i32::MAX,
];

fn half(n: i32) -> f64 {
    f64::from(n) / 2f64.powi(32)
}

/// Returns a surface whose coefficients are `shape` times the largest factor for which they can be written in fixed
/// point. The factor is exact to one part in 2^40.
fn largest(shape: [f64; 7]) -> FixedPoly13 {
    let scaled = |k: f64| {
        let [p00, p10, p01, p11, p02, p12, p03] = shape.map(|c| c * k);
        FixedPoly13::new(&Poly13 { p00, p10, p01, p11, p02, p12, p03 })
    };
    let (mut low, mut high) = (1.0, 1e11);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if scaled(middle).is_ok() { low = middle } else { high = middle }
    }
    scaled(low).unwrap()
}

fn close(surface: &FixedPoly13, rate: i32, volts: i32) -> Result<(), String> {
    // compared with the rounded coefficients, so only the rounding of the products remains
    let exact = surface.coefficients().eval(half(rate), half(volts));
    let found = f64::from(surface.eval(rate, volts));
    if abs_diff_eq!(found, exact, epsilon = FixedPoly13::ROUNDING) {
        Ok(())
    } else {
        Err(format!("{surface:?} at {rate}, {volts}: {found} for {exact}"))
    }
}

#[test]
fn the_largest_surface_of_every_sign_holds_at_every_corner() {
    // 3^7 sign patterns, each scaled up until it just fits
    for pattern in 0..3u32.pow(7) {
        let mut rest = pattern;
        let shape = [(); 7].map(|()| {
            let sign = f64::from(rest % 3) - 1.0;
            rest /= 3;
            sign
        });
        if shape == [0.0; 7] {
            continue;
        }
        let surface = largest(shape);
        for rate in CORNERS {
            for volts in CORNERS {
                close(&surface, rate, volts).unwrap();
            }
        }
    }
}

#[test]
fn the_largest_line_holds_at_every_corner() {
    for (intercept, slope) in [(2.14e9, 0.0), (1.0e9, 2.14e9), (-1.0e9, 2.14e9), (0.0, -2.14e9)] {
        let line = FixedLine::new(intercept, slope).unwrap();
        for volts in CORNERS {
            let (found, exact) = (f64::from(line.eval(volts)), intercept + slope * half(volts));
            let near = abs_diff_eq!(found, exact, epsilon = FixedLine::ROUNDING);
            assert!(near, "{line:?} at {volts}: {found} for {exact}");
        }
    }
    assert!(FixedLine::new(1.2e9, 2.0e9).is_err());
    assert!(FixedLine::new(f64::NAN, 0.0).is_err());
}

proptest! {
    #[test]
    fn a_surface_is_within_its_rounding_or_refused(
        coefficients in prop::array::uniform7(-3e9..3e9f64),
        scale in 0.0..1.0f64, rate: i32, volts: i32,
    ) {
        let [p00, p10, p01, p11, p02, p12, p03] = coefficients.map(|c| c * scale);
        let surface = Poly13 { p00, p10, p01, p11, p02, p12, p03 };
        if let Ok(fixed) = FixedPoly13::new(&surface) {
            let exact = surface.eval(half(rate), half(volts));
            let found = f64::from(fixed.eval(rate, volts));
            assert_abs_diff_eq!(found, exact, epsilon = FixedPoly13::ROUNDING);
        }
    }

    #[test]
    fn a_record_of_any_integers_loads_safe_or_not_at_all(
        coefficients: [i32; 7], line: (i32, i32), rate: i32, volts: i32,
    ) {
        if let Ok(surface) = FixedPoly13::try_from(coefficients) {
            prop_assert_eq!(<[i32; 7]>::from(surface), coefficients);
            prop_assert!(close(&surface, rate, volts).is_ok());
        }
        if let Ok(fixed) = FixedLine::try_from(line) {
            let exact = f64::from(line.0) + f64::from(line.1) * half(volts);
            assert_abs_diff_eq!(f64::from(fixed.eval(volts)), exact, epsilon = tol::LAST_ROUNDING);
        }
    }

    #[test]
    fn a_range_is_the_real_one_saturated(
        range in stretch_strategies::range(), step in 1e-4..1.0f64, zero in -10.0..10.0f64, x: i32,
    ) {
        let Ok(fixed) = FixedRange::new(&range, RangeUnits { zero, step }) else {
            return Ok(());
        };
        for x in [x, x >> 8, x >> 16, x >> 24].into_iter().chain(CORNERS) {
            // `x - offset` saturates first
            let whole = ((range.offset() - zero) / step).round();
            let moved = saturate(i64::from(x) - whole as i64);
            let channel = zero + step * (f64::from(moved) + whole);
            let exact = saturate((range.normalise(channel) * 2f64.powi(27)).round() as i64);
            let found = f64::from(fixed.normalise(x));
            // rounding of the 30-bit gain over a full-scale input, and the last rounding
            let bound = 2.0 + f64::from(exact).abs() * 2f64.powi(-29);
            let near = abs_diff_eq!(found, f64::from(exact), epsilon = bound);
            prop_assert!(near, "{x}: {found} for {exact}");
        }
        for n in [x, x >> 3].into_iter().chain(CORNERS) {
            let real: f64 = (range.denormalise(f64::from(n) / 2f64.powi(27)) - zero) / step;
            let exact = saturate(real.round() as i64);
            let found = f64::from(fixed.denormalise(n));
            let bound = 1.0 + f64::from(exact).abs() * 2f64.powi(-29);
            let near = abs_diff_eq!(found, f64::from(exact), epsilon = bound);
            prop_assert!(near, "{n}: {found} for {exact}");
        }
    }

    #[test]
    fn a_range_brings_codes_back(range in stretch_strategies::range(), code in 0..65_536i32) {
        // a 16-bit converter whose input span is three times the range, with the range in the middle
        let step = 3.0 * range.span() / 65_535.0;
        let units = RangeUnits { zero: range.min() - range.span(), step };
        // refused if the offset is too far outside the range for 32 bits
        let Ok(fixed) = FixedRange::new(&range, units) else { return Ok(()) };
        let n = fixed.normalise(code);
        if n < i32::MAX && n > i32::MIN {
            prop_assert_eq!(fixed.denormalise(n), code);
        }
    }
}

#[test]
fn a_range_that_does_not_fit_is_refused() {
    let range = |min, max| {
        let spec = stretch_core::RangeSpec {
            mode: stretch_core::Normalisation::MinMax,
            zero: 0.0,
            min,
            max,
        };
        Range::new(spec).unwrap()
    };
    let units = RangeUnits { zero: 0.0, step: 1e-3 };
    assert!(FixedRange::new(&range(0.0, 1.0), units).is_ok());
    assert!(FixedRange::new(&range(1e9, 2e9), units).is_err());
    assert!(FixedRange::new(&range(0.0, 1.0), RangeUnits { step: 0.0, ..units }).is_err());
    assert!(FixedRange::new(&range(0.0, 1.0), RangeUnits { zero: f64::NAN, ..units }).is_err());
    assert!(FixedRange::new(&range(0.0, 1e-15), units).is_err());
}
