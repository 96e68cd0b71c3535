//! Tests of inputs that must be refused, and of the errors.

use approx::assert_abs_diff_eq;
use stretch_core::{Degree, Real};
use stretch_fit::{
    Factor, FactorSpec, FitError, Loss, Sample, SurfaceAccumulator, cross_validate, robust_fit,
};
use testkit::tolerance::F64_ROUNDING;

/// Accumulates values at the volts 0, 1, 2 ... for a line.
fn line(values: impl IntoIterator<Item = f64>) -> SurfaceAccumulator<f64, 2> {
    let mut sums = SurfaceAccumulator::of::<0, 1>();
    let sample = |(k, value): (u32, f64)| Sample { rate: 0.0, volts: f64::from(k), value };
    sums.extend((0..).zip(values).map(sample)).unwrap();
    sums
}

fn poly13() -> SurfaceAccumulator<f64, 7, 16> {
    SurfaceAccumulator::of::<1, 3>()
}

#[test]
fn the_term_that_the_data_cannot_determine_is_named() {
    // Rate and volts of sample k, and the first term that depends on those before it.
    type Point = fn(u32) -> (f64, f64);
    let cases: [(Point, (u8, u8), &str); 6] = [
        (|k| (0.7, f64::from(k) / 50.0), (1, 0), "p10 (rate)"),
        (|k| (f64::from(k % 7), 1.24), (0, 1), "p01 (volts)"),
        (|k| (f64::from(k), 0.3 * f64::from(k) - 2.0), (0, 1), "p01 (volts)"),
        (|k| (f64::from(k % 7), f64::from(k % 2)), (0, 2), "p02 (volts^2)"),
        (|k| (f64::from(k % 7), 1.24 + 0.001 * f64::from(k % 3)), (0, 3), "p03 (volts^3)"),
        (
            |k| (f64::from(k % 2) * f64::from(k % 3), f64::from(k % 3)),
            (1, 2),
            "p12 (rate * volts^2)",
        ),
    ];
    for (point, (rate_power, volts_power), name) in cases {
        let mut sums = poly13();
        for k in 0..100 {
            let (rate, volts) = point(k);
            sums.push(Sample { rate, volts, value: f64::from(k * k % 17) }).unwrap();
        }
        let error = sums.fit().unwrap_err();
        assert_eq!(error, FitError::RankDeficient { rate_power, volts_power }, "{name}");
        assert!(error.to_string().contains(name), "{error}");
    }
}

/// Returns the error of a fit to volts that are a linear function of the rate, so that p01 depends
/// on p00 and p10.
fn dependent<T: Real, const ROWS: usize>(samples: u32, offset: f64) -> FitError {
    let mut sums = SurfaceAccumulator::<T, 7, ROWS>::of::<1, 3>();
    for k in 0..samples {
        let rate = (f64::from(k) * 0.618_033_988_749).fract();
        let (rate, volts) = (T::from_f64(rate), T::from_f64(offset + 3.0 * rate));
        sums.push(Sample { rate, volts, value: T::from_f64(0.5) }).unwrap();
    }
    sums.fit().unwrap_err()
}

#[test]
fn dependence_is_seen_through_the_rounding_of_a_long_log() {
    let p01 = FitError::RankDeficient { rate_power: 0, volts_power: 1 };
    for offset in [0.0, 1.24, 1e3] {
        assert_eq!(dependent::<f64, 128>(300_000, offset), p01);
        assert_eq!(dependent::<f64, 8>(300_000, offset), p01);
        assert_eq!(dependent::<f32, 8>(300_000, offset), p01);
        assert_eq!(dependent::<f64, 1>(10_000, offset), p01);
        assert_eq!(dependent::<f32, 1>(10_000, offset), p01);
    }
}

#[test]
fn too_few_samples() {
    let mut sums = poly13();
    for k in 0..6 {
        sums.push(Sample { rate: f64::from(k % 2), volts: f64::from(k), value: 1.0 }).unwrap();
    }
    let error = sums.fit().unwrap_err();
    assert_eq!(error, FitError::TooFewSamples { needed: 7, got: 6 });
    assert_eq!(error.to_string(), "7 samples are needed, but there are 6");
    assert_eq!(poly13().fit().unwrap_err(), FitError::TooFewSamples { needed: 7, got: 0 });
}

#[test]
fn as_many_samples_as_terms_leave_no_degree_of_freedom() {
    let fit = line([1.0, 3.0]).fit().unwrap();
    assert_abs_diff_eq!(fit.coefficients()[1], 2.0, epsilon = F64_ROUNDING);
    assert_eq!((fit.dof(), fit.rmse()), (0, None));
    assert!(fit.standard_errors().is_none() && fit.adjusted_r_squared().is_none());
    let error = fit.confidence(0.95).unwrap_err();
    assert_eq!(error, FitError::TooFewSamples { needed: 3, got: 2 });
}

#[test]
fn numbers_that_are_not_finite_or_overflow_are_not_added() {
    let mut sums = poly13();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
        for (field, sample) in
            [("rate", [bad, 0.0, 0.0]), ("volts", [0.0, bad, 0.0]), ("value", [0.0, 0.0, bad])]
        {
            let [rate, volts, value] = sample;
            let sample = Sample { rate, volts, value };
            for error in
                [sums.push(sample).unwrap_err(), sums.push_weighted(sample, 1.0).unwrap_err()]
            {
                let named = matches!(error, FitError::OutOfRange { field: f, .. } if f == field);
                assert!(named, "{error:?} should name {field}");
                assert!(error.to_string().starts_with(field), "{error}");
            }
        }
    }
    let zero = Sample { rate: 0.0, volts: 0.0, value: 0.0 };
    for bad in [f64::NAN, f64::INFINITY, -1.0, f64::MAX] {
        let error = sums.push_weighted(zero, bad).unwrap_err();
        assert!(matches!(error, FitError::OutOfRange { field: "weight", .. }), "{error:?}");
    }
    assert_eq!(sums, poly13());
}

#[test]
fn a_sample_without_weight_is_not_counted() {
    let mut sums = poly13();
    sums.push_weighted(Sample { rate: 1.0, volts: 1.0, value: 1.0 }, 0.0).unwrap();
    assert_eq!(sums, poly13());
}

#[test]
fn degrees_must_have_room_and_agree() {
    let mut sums = SurfaceAccumulator::<f64>::new(Degree::POLY13);
    let other = SurfaceAccumulator::new(Degree::new(1, 2).unwrap());
    let damaged = FactorSpec { degree: Degree::new(2, 3).unwrap(), ..poly13().factor().spec() };
    let room = FitError::TooManyTerms { terms: 9, room: 7 };
    assert_eq!(stretch_fit::Factor::new(damaged), Err(room));
    assert!(poly13().factor().restrict(damaged.degree).is_err());
    let missing = FitError::MissingTerm { rate_power: 1, volts_power: 2 };
    assert_eq!(sums.merge(&other).unwrap_err(), missing);
    assert_eq!(other.factor().fit_degree(Degree::POLY13).unwrap_err(), missing);
}

#[test]
fn levels_lie_between_0_and_1() {
    let fit = line((0..9).map(|k| f64::from(k * k))).fit().unwrap();
    for level in [0.0, 1.0, -0.5, 95.0, f64::NAN] {
        assert!(matches!(fit.confidence(level), Err(FitError::Level { .. })), "{level}");
    }
    assert!(fit.confidence(0.95).is_ok());
}

#[test]
fn equal_values_have_no_r_squared() {
    let fit = line([0.0; 9]).fit().unwrap();
    assert_eq!(fit.r_squared(), None);
    assert_eq!(fit.adjusted_r_squared(), None);
    assert_eq!(fit.rmse(), Some(0.0));
}

#[test]
fn robust_fits_need_memory_and_a_degree_of_freedom() {
    let sample = |k| Sample { rate: 0.0, volts: f64::from(k), value: f64::from(k % 3) };
    let samples = |n: u32| move || (0..n).map(sample);
    let line = Degree::LINE;
    let mut memory = [0.0; 9];
    let short = robust_fit(line, Loss::Bisquare, samples(10), &mut memory);
    assert_eq!(short.unwrap_err(), FitError::ShortMemory { needed: 10, got: 9 });
    let few = robust_fit(line, Loss::Bisquare, samples(2), &mut memory);
    assert_eq!(few.unwrap_err(), FitError::TooFewSamples { needed: 3, got: 2 });
}

#[test]
fn cross_validation_needs_two_trials() {
    let none: [stretch_fit::Factor<f64, 7>; 0] = [];
    let needed = FitError::TooFewSamples { needed: 7, got: 0 };
    assert_eq!(cross_validate(&none, Degree::POLY13).unwrap_err(), needed);
    let mut sums = poly13();
    for k in 0..50 {
        let [rate, volts, value] = [k % 5, k % 7, k % 11].map(f64::from);
        sums.push(Sample { rate, volts, value }).unwrap();
    }
    assert_eq!(cross_validate(&[sums.factor()], Degree::POLY13).unwrap_err(), needed);
    assert!(cross_validate(&[sums.factor(), sums.factor()], Degree::POLY13).is_ok());
}

#[test]
fn counts_that_were_damaged_where_they_were_stored_never_panic() {
    let mut sums = poly13();
    for k in 0..50 {
        let [rate, volts, value] = [k % 5, k % 7, k % 11].map(f64::from);
        sums.push(Sample { rate, volts, value }).unwrap();
    }
    let sound = sums.factor();
    for (samples, folds) in [(u64::MAX, u64::MAX), (50, u64::MAX), (u64::MAX, 0), (1, 0)] {
        let damaged = Factor::new(FactorSpec { samples, folds, ..sound.spec() }).unwrap();
        let mut both = damaged;
        both.merge(&damaged).unwrap();
        both.merge(&sound).unwrap();
        assert_eq!(both.samples(), samples.saturating_mul(2).saturating_add(50));
        for degree in [Degree::POLY13, Degree::new(1, 2).unwrap(), Degree::LINE] {
            let lower = both.restrict(degree).unwrap();
            assert_eq!(lower.samples(), both.samples());
            // with so many folds the allowed rounding error may exceed every term, and the fit is refused
            let Ok(fit) = lower.fit() else { continue };
            assert!(fit.coefficients().iter().all(|c| c.is_finite()));
            assert!(fit.adjusted_r_squared().is_none_or(f64::is_finite));
            let judged = cross_validate(&[damaged, damaged, sound], degree);
            assert!(judged.is_err() || judged.unwrap().rmse.is_finite());
        }
    }
}
