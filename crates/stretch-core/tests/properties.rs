//! Property tests of identities that hold for every range, surface and calibration.

use approx::assert_abs_diff_eq;
use proptest::prelude::*;
use stretch_core::{
    Branch, Calibration, CalibrationSpec, Degree, DesignError, Normalisation, Poly13, Range,
    RangeSpec, Real, Surface,
};
use testkit::tolerance as tol;

/// Evaluates a surface term by term, for comparison with Horner's rule.
fn naive(surface: &Surface, rate: f64, volts: f64) -> f64 {
    let terms = surface.degree().exponents();
    terms.map(|(i, j)| surface.coefficient(i, j) * rate.powi(i.into()) * volts.powi(j.into())).sum()
}

proptest! {
    #[test]
    fn normalise_and_back(range in stretch_strategies::range(), n in -2.0..2.0) {
        let x = range.denormalise(n);
        let scale = (range.offset().abs() + range.span()) / range.span();
        assert_abs_diff_eq!(
            range.normalise(x),
            n,
            epsilon = tol::RANGE_ROUND_TRIP * scale.max(1.0)
        );
    }

    #[test]
    fn min_max_maps_its_ends_to_zero_and_one(range in stretch_strategies::range()) {
        let spec = RangeSpec { mode: Normalisation::MinMax, ..range.into() };
        let range = Range::new(spec).unwrap();
        prop_assert_eq!(range.normalise(spec.min), 0.0);
        prop_assert_eq!(range.normalise(spec.max), 1.0);
    }

    #[test]
    fn normalise_rises(range in stretch_strategies::range(), a in -1e3..1e3, b in -1e3..1e3) {
        let (low, high) = if a < b { (a, b) } else { (b, a) };
        prop_assert!(range.normalise(low) <= range.normalise(high));
        prop_assert!(range.contains(range.clamp(a)));
    }

    #[test]
    fn horner_equals_the_sum_of_terms(
        surface in stretch_strategies::surface(), rate in -2.0..2.0, volts in -2.0..2.0,
    ) {
        let (found, exact) = (surface.eval(rate, volts), naive(&surface, rate, volts));
        assert_abs_diff_eq!(found, exact, epsilon = tol::HORNER);
    }

    #[test]
    fn partial_derivatives_are_the_slopes(
        surface in stretch_strategies::surface(), rate in -1.0..1.0, volts in -1.0..1.0,
    ) {
        let h = 1e-5;
        let by_rate = (naive(&surface, rate + h, volts) - naive(&surface, rate - h, volts)) / (2.0 * h);
        let by_volts = (naive(&surface, rate, volts + h) - naive(&surface, rate, volts - h)) / (2.0 * h);
        // error of the difference quotient: truncation h^2/6 times a third derivative of at most 21 * 3 * 60, and
        // rounding 1e-16/h
        let tolerance = 1e-10 / 6.0 * 21.0 * 3.0 * 60.0 + 63.0 * 1e-15 / h;
        assert_abs_diff_eq!(surface.d_rate(rate, volts), by_rate, epsilon = tolerance);
        assert_abs_diff_eq!(surface.d_volts(rate, volts), by_volts, epsilon = tolerance);
    }

    #[test]
    fn poly13_and_the_general_surface_agree(
        surface in stretch_strategies::surface_of(Degree::POLY13), rate in -2.0..2.0, volts in -2.0..2.0,
    ) {
        let poly: Poly13 = surface.as_poly13().unwrap();
        prop_assert_eq!(Surface::from(poly), surface);
        assert_abs_diff_eq!(
            poly.eval(rate, volts),
            surface.eval(rate, volts),
            epsilon = tol::HORNER
        );
        assert_abs_diff_eq!(poly.d_rate(volts), surface.d_rate(rate, volts), epsilon = tol::HORNER);
        assert_abs_diff_eq!(
            poly.d_volts(rate, volts),
            surface.d_volts(rate, volts),
            epsilon = 4.0 * tol::HORNER
        );
    }

    #[test]
    fn coefficients_survive(surface in stretch_strategies::surface()) {
        let terms = surface.degree().terms();
        let again = Surface::new(surface.degree(), &surface.coefficients()[..terms]).unwrap();
        prop_assert_eq!(again, surface);
    }

    #[test]
    fn the_term_set_is_matlabs(degree in stretch_strategies::degree()) {
        let exponents: Vec<_> = degree.exponents().collect();
        prop_assert_eq!(exponents.len(), degree.terms());
        let most = degree.rate().max(degree.volts());
        for i in 0..=5 {
            for j in 0..=5 {
                let belongs = i <= degree.rate() && j <= degree.volts() && i + j <= most;
                prop_assert_eq!(exponents.contains(&(i, j)), belongs);
            }
        }
        let order = |&(i, j): &(u8, u8)| (i + j, core::cmp::Reverse(i));
        prop_assert!(exponents.windows(2).all(|pair| order(&pair[0]) < order(&pair[1])));
    }

    #[test]
    fn a_branch_changes_only_beyond_the_dead_band(rate in -1.0..1.0f64, dead_band in 0.0..1.0) {
        for branch in [Branch::Inflation, Branch::Deflation] {
            let next = branch.next(rate, dead_band);
            if rate.abs() <= dead_band {
                prop_assert_eq!(next, branch);
            } else {
                prop_assert_eq!(next == Branch::Inflation, rate > 0.0);
            }
            prop_assert_eq!(branch.next(f64::NAN, dead_band), branch);
        }
    }

    #[test]
    fn json_and_postcard_keep_every_bit(calibration in stretch_strategies::calibration()) {
        let json = serde_json::to_string(&calibration).unwrap();
        prop_assert_eq!(&serde_json::from_str::<Calibration>(&json).unwrap(), &calibration);
        let mut buffer = [0; 4096];
        let bytes = postcard::to_slice(&calibration, &mut buffer).unwrap();
        prop_assert_eq!(postcard::from_bytes::<Calibration>(bytes).unwrap(), calibration);
    }

    #[test]
    fn a_truncated_or_damaged_record_never_panics(
        calibration in stretch_strategies::calibration(), cut in 0usize..1500, at in 0usize..1500, byte: u8,
    ) {
        let mut buffer = [0; 4096];
        let bytes = postcard::to_slice(&calibration, &mut buffer).unwrap();
        let length = bytes.len();
        prop_assert!(postcard::from_bytes::<Calibration>(&bytes[..cut % length]).is_err());
        bytes[at % length] = byte;
        if let Ok(calibration) = postcard::from_bytes::<Calibration>(bytes) {
            // damaged bytes that still load must give a calibration that passes its own checks
            prop_assert!(Calibration::new(CalibrationSpec::from(calibration)).is_ok());
        }
    }

    #[test]
    fn a_range_without_extent_is_refused(min in -1e3..1e3, less in 0.0..1e3) {
        let spec = RangeSpec { mode: Normalisation::Range, zero: 0.0, min, max: min - less };
        let refused = matches!(Range::new(spec), Err(DesignError::EmptyRange { .. }));
        prop_assert!(refused);
    }
}

#[test]
fn square_root_is_ieee() {
    for x in [0.0_f64, 2.0, 1e-300, 1e300, 0.1] {
        assert_eq!(Real::sqrt(x).to_bits(), f64::sqrt(x).to_bits());
        assert_eq!(Real::sqrt(x as f32).to_bits(), f32::sqrt(x as f32).to_bits());
    }
}
