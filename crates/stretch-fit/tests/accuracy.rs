//! Tests of accuracy in hard cases: narrow raw volts, `f32`, long logs, outliers.

use stretch_core::{Degree, Real};
use stretch_fit::{FitError, Loss, Sample, SurfaceAccumulator, robust_fit};
use testkit::tolerance as tol;

const TRUTH: [f64; 7] = [0.058, 0.001, 0.774, -0.121, 2.30, 0.094, -2.26];

fn surface(r: f64, v: f64) -> f64 {
    let [p00, p10, p01, p11, p02, p12, p03] = TRUTH;
    p00 + p01 * v + p02 * v * v + p03 * v * v * v + r * (p10 + p11 * v + p12 * v * v)
}

/// Returns points that fill a rectangle evenly: rate in -1 to 1, volts around `centre`.
fn points(samples: u32, centre: f64, width: f64) -> impl Iterator<Item = (f64, f64)> {
    (0..samples).map(move |k| {
        let (a, b) =
            (f64::from(k) * 0.754_877_666_246_692_7, f64::from(k) * 0.569_840_290_998_053_2);
        (2.0 * a.fract() - 1.0, centre + width * (b.fract() - 0.5))
    })
}

fn error<T: Real, const ROWS: usize>(samples: u32, centre: f64, width: f64) -> (f64, f64) {
    let mut sums = SurfaceAccumulator::<T, 7, ROWS>::of::<1, 3>();
    for (rate, volts) in points(samples, centre, width) {
        let (rate, volts) = (T::from_f64(rate), T::from_f64(volts));
        // The value is computed from the inputs after rounding to the type.
        let value = T::from_f64(surface(rate.as_f64(), volts.as_f64()));
        sums.push(Sample { rate, volts, value }).unwrap();
    }
    let fit = sums.fit().unwrap();
    let off: f64 =
        fit.coefficients().iter().zip(TRUTH).map(|(c, t)| (c.as_f64() - t).powi(2)).sum();
    let surfaces = points(1000, centre, width).map(|(rate, volts)| {
        let found = fit.surface().eval(T::from_f64(rate), T::from_f64(volts)).as_f64();
        (found - surface(rate, volts)).abs()
    });
    let worst = surfaces.fold(0.0, f64::max);
    (off.sqrt() / TRUTH.iter().map(|t| t * t).sum::<f64>().sqrt(), worst)
}

#[test]
fn raw_volts_of_condition_1e8_keep_ten_digits() {
    let (off, _) = error::<f64, 128>(100_000, 1.24, 0.02);
    assert!(off < tol::FIT_ILL_LONG, "off by {off:e}");
    let (off, _) = error::<f64, 8>(100_000, 1.24, 0.02);
    assert!(off < tol::FIT_ILL_LONG, "rows of 8: off by {off:e}");
}

#[test]
fn f32_holds_on_a_board() {
    let (off, worst) = error::<f32, 8>(20_000, 0.35, 1.0);
    assert!(off < tol::FIT_F32, "normalised: off by {off:e}");
    assert!(worst < tol::FIT_F32, "normalised: surface off by {worst:e}");
    // The condition is 4e4, at which normal equations in f32 lose every digit.
    let (off, worst) = error::<f32, 8>(20_000, 1.1, 0.25);
    assert!(off < tol::FIT_F32, "narrow: off by {off:e}");
    assert!(worst < tol::FIT_F32, "narrow: surface off by {worst:e}");
}

#[test]
fn a_long_f32_log_does_not_stall() {
    let (off, _) = error::<f32, 32>(1_000_000, 0.35, 1.0);
    assert!(off < tol::FIT_F32, "off by {off:e}");
}

/// Checks that bounds at 95 % contain the truth in 95 % of the repetitions, for normal errors, with least squares,
/// bisquare and least absolute residuals.
#[test]
fn bounds_hold_the_truth_as_often_as_they_say() {
    let mut state = 7_u64;
    let mut uniform = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    const RUNS: usize = 200;
    let mut held = [[0; 7]; 3];
    for _ in 0..RUNS {
        let samples: Vec<Sample<f64>> = points(150, 0.35, 1.0)
            .map(|(rate, volts)| {
                let normal = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                Sample { rate, volts, value: surface(rate, volts) + 0.1 * normal }
            })
            .collect();
        let mut sums = SurfaceAccumulator::<f64, 21, 32>::new(Degree::POLY13);
        sums.extend(samples.iter().copied()).unwrap();
        let mut memory = [0.0; 150];
        let mut robust = |loss| {
            let again = || samples.iter().copied();
            robust_fit(Degree::POLY13, loss, again, &mut memory).unwrap().fit
        };
        let fits = [sums.fit().unwrap(), robust(Loss::Bisquare), robust(Loss::LeastAbsolute)];
        for (fit, held) in fits.iter().zip(&mut held) {
            let bounds = fit.confidence(0.95).unwrap();
            for (k, truth) in TRUTH.into_iter().enumerate() {
                let bounds = bounds.coefficient(k).unwrap();
                held[k] += usize::from(bounds.lower <= truth && truth <= bounds.upper);
            }
        }
    }
    // The share is computed from 7 * 200 bounds. The bounds of one run are correlated, so the tolerance is that for 200
    // bounds of a single coefficient: 4.6 %, three standard errors.
    for (fit, held) in ["plain", "bisquare", "least absolute"].iter().zip(held) {
        let share = held.iter().sum::<usize>() as f64 / (7 * RUNS) as f64;
        assert!((0.95 - 0.046..=0.95 + 0.046).contains(&share), "{fit}: {share}");
    }
}

/// Fits a curve to raw counts around an offset. Returns the RMS error that the fit states and the one computed from its
/// surface, or `None` if the fit is refused.
fn stated_and_found(offset: f64, half: f64, cubic: Degree) -> Option<(f64, f64)> {
    let sample = |k: u32| {
        let x = f64::from(k % 201) / 100.0 - 1.0;
        Sample {
            rate: 0.0,
            volts: offset + half * x,
            value: 50.0 + 40.0 * x + 9.0 * x * x - 11.0 * x * x * x,
        }
    };
    let mut sums = SurfaceAccumulator::<f64>::new(cubic);
    sums.extend((0..2010).map(sample)).unwrap();
    let fit = match sums.fit() {
        Ok(fit) => fit,
        Err(FitError::RankDeficient { .. }) => return None,
        Err(other) => panic!("{other}"),
    };
    let squares =
        (0..2010).map(sample).map(|s| (fit.surface().eval(0.0, s.volts) - s.value).powi(2));
    Some((fit.rmse().unwrap(), (squares.sum::<f64>() / 2010.0).sqrt()))
}

#[test]
fn the_error_that_a_fit_states_is_that_of_its_surface() {
    let cubic = Degree::new(0, 3).unwrap();
    // 24-bit counts of a load cell, for which the terms over raw counts cancel to 13 digits
    assert_eq!(stated_and_found(8.3e6, 100.0, cubic), None);
    for (offset, half) in
        [(0.0, 1.0), (3.0, 1.0), (30.0, 1.0), (100.0, 1.0), (2.5, 0.004), (1000.0, 1.0)]
    {
        let Some((stated, found)) = stated_and_found(offset, half, cubic) else { continue };
        assert!(
            found <= 3.0 * stated + 1e-13,
            "{offset}, {half}: stated {stated:e}, found {found:e}"
        );
    }
    assert!(stated_and_found(100.0, 1.0, cubic).is_some());
    // with the origin in the middle, no digits are lost
    let line = |k: u32| Sample { rate: 0.0, volts: 8.3e6 + f64::from(k), value: f64::from(k * k) };
    let mut sums = SurfaceAccumulator::<f64>::new(cubic);
    sums.extend((0..200).map(line)).unwrap();
    assert!(sums.fit().is_err());
    let about = sums.factor().counted_from(8.3e6 + 100.0).fit().unwrap();
    assert!(about.rmse().unwrap() < 1e-8, "{:?}", about.rmse());
}
