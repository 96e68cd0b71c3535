//! Logs with even and uneven time stamps.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use proptest::prelude::*;
use stretch_core::{Runner, SampleRate, Seconds};
use stretch_filter::log::{
    Between, Grid, LocalFit, central_difference, local_polynomial, resample,
};
use stretch_filter::{Arrival, Cadence, FilterError, SgFilter, SgShape};
use testkit::tolerance;

const HZ: f64 = 100.0;

fn hundred() -> SampleRate {
    SampleRate::new(HZ).unwrap()
}

fn fit(window: usize, degree: usize, order: usize) -> LocalFit {
    LocalFit { window, degree, order, longest_step: Seconds(0.1) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn local_fits_are_exact_on_polynomials_at_uneven_times(
        times in stretch_strategies::uneven_times(40, 1.0 / HZ), signal in stretch_strategies::polynomial(3),
    ) {
        let log: Vec<f64> = times.iter().map(|&t| signal.value(t)).collect();
        let mut out = vec![None; log.len()];
        local_polynomial(fit(11, 3, 1), &times, &log, &mut out).unwrap();
        for (&t, y) in times.iter().zip(&out) {
            assert_abs_diff_eq!(y.unwrap(), signal.rate(t), epsilon = tolerance::LOCAL_RATE);
        }
        local_polynomial(fit(11, 3, 0), &times, &log, &mut out).unwrap();
        for (&x, y) in log.iter().zip(&out) {
            assert_abs_diff_eq!(y.unwrap(), x, epsilon = tolerance::LOCAL_VALUE);
        }
    }

    #[test]
    fn on_even_times_a_local_fit_is_savitzky_golay(
        log in prop::collection::vec(-1.0..1.0, 30..60), half in 2_usize..6, degree in 1_usize..4,
    ) {
        let window = 2 * half + 1;
        let times: Vec<f64> = (0..log.len()).map(|n| n as f64 / HZ).collect();
        let mut local = vec![None; log.len()];
        local_polynomial(fit(window, degree, 1), &times, &log, &mut local).unwrap();
        let sg = SgFilter::<f64, 16>::new(SgShape::centred_rate(window, degree), hundred()).unwrap();
        let mut even = vec![0.0; log.len()];
        sg.over_log(&log, &mut even).unwrap();
        for (a, b) in local.iter().zip(&even) {
            prop_assert!(abs_diff_eq!(a.unwrap(), b, epsilon = tolerance::LOCAL_RATE), "{a:?} {b}");
        }
    }

    #[test]
    fn resampling_is_exact_on_its_own_polynomials(
        times in stretch_strategies::uneven_times(30, 1.0 / HZ),
        line in stretch_strategies::polynomial(1), cubic in stretch_strategies::polynomial(3),
    ) {
        let grid = Grid { start: Seconds(0.0), sample_rate: hundred() };
        let points = grid.points_until(Seconds(times[29]));
        prop_assert!(grid.time_s(points - 1) <= times[29] && grid.time_s(points) > times[29]);
        let mut out = vec![0.0; points];
        for (signal, between) in [(&line, Between::Linear), (&cubic, Between::Cubic)] {
            let log: Vec<f64> = times.iter().map(|&t| signal.value(t)).collect();
            resample(&times, &log, grid, between, &mut out).unwrap();
            for (i, y) in out.iter().enumerate() {
                assert_abs_diff_eq!(
                    *y,
                    signal.value(grid.time_s(i)),
                    epsilon = tolerance::LOCAL_VALUE
                );
            }
        }
    }

    #[test]
    fn bad_logs_are_refused_and_nothing_is_written(
        mut times in stretch_strategies::uneven_times(20, 0.01), at in 1_usize..20, back in 0.0..1.0,
    ) {
        times[at] = times[at - 1] - back;
        let log = vec![1.0; 20];
        let mut out = vec![Some(7.0); 20];
        let error = local_polynomial(fit(5, 2, 1), &times, &log, &mut out).unwrap_err();
        prop_assert_eq!(
            error,
            FilterError::NotIncreasing { index: at, before_s: times[at - 1], time_s: times[at] }
        );
        prop_assert!(out.iter().all(|y| *y == Some(7.0)));
    }

    #[test]
    fn finite_logs_give_finite_rates(
        steps in prop::collection::vec(prop_oneof![1e-12..1e-9, 1e-3..1e-1], 12),
        log in prop::collection::vec(-1e17..1e17, 12),
    ) {
        let mut time_s = 0.0;
        let times: Vec<f64> = steps.iter().map(|s| { time_s += s; time_s }).collect();
        let mut out = vec![None::<f64>; 12];
        local_polynomial(fit(7, 4, 1), &times, &log, &mut out).unwrap();
        prop_assert!(out.iter().flatten().all(|y: &f64| y.is_finite()));
    }

    #[test]
    fn a_cadence_counts_what_is_missing(missing in 0_u32..1000, jitter in 0.0..0.2_f64) {
        let mut cadence = Runner::new(Cadence::new(hundred(), 0.25).unwrap());
        cadence.step(Seconds(5.0));
        let arrival = cadence.step(Seconds(5.0 + (f64::from(missing) + 1.0 + jitter) / HZ));
        if missing == 0 {
            prop_assert_eq!(arrival, Arrival::OnTime);
        } else {
            prop_assert_eq!(arrival, Arrival::Gap { missing });
        }
    }

    /// Every stamp is moved by up to `size` periods to either side, and the clock is slow. An early stamp can hide a
    /// lost sample until a later stamp shows it, so no sample is lost among the last fifty.
    #[test]
    fn jitter_makes_no_gap_and_hides_no_loss(
        size in 0.0..0.44_f64, slow in 0.0..0.002_f64, share in 0.0..0.1_f64,
        samples in prop::collection::vec((-1.0..1.0_f64, 0.0..1.0_f64, 1_u32..6), 50..400),
    ) {
        let mut cadence = Runner::new(Cadence::new(hundred(), 0.25).unwrap());
        let (mut place, mut lost, mut found) = (0.0, 0, 0);
        let last_loss = samples.len() - 50;
        for (n, (jitter, chance, length)) in samples.into_iter().enumerate() {
            let gap = if (20..last_loss).contains(&n) && chance < share { length } else { 0 };
            (place, lost) = (place + 1.0 + f64::from(gap), lost + gap);
            let stamp_s = (place * (1.0 + slow) + size * jitter) / HZ;
            if let Arrival::Gap { missing } = cadence.step(Seconds(stamp_s)) {
                found += missing;
            }
            prop_assert!(found <= lost, "{found} of {lost} at sample {n}");
        }
        prop_assert_eq!(found, lost);
    }
}

#[test]
fn a_long_log_has_the_bits_of_the_live_filter() {
    let shape = SgShape { window: 12, degree: 3, order: 1, delay: 4 };
    let filter = SgFilter::<f64, 16>::new(shape, hundred()).unwrap();
    let log: Vec<f64> = (0..1000).map(|n| (n as f64 * 0.37).sin()).collect();
    let mut whole = vec![0.0; log.len()];
    filter.over_log(&log, &mut whole).unwrap();
    let mut live = Runner::new(filter);
    for (n, &x) in log.iter().enumerate() {
        if let Some(rate) = live.step(x) {
            assert_eq!(rate, whole[n - shape.delay], "sample {n}");
        }
    }
}

#[test]
fn a_fit_does_not_reach_across_a_gap() {
    // Two ramps of opposite slope, and one isolated sample between two gaps.
    let mut times: Vec<f64> = (0..10).map(|n| n as f64 / HZ).collect();
    times.push(1.0);
    times.extend((0..10).map(|n| 2.0 + n as f64 / HZ));
    let log: Vec<f64> = times.iter().map(|&t| if t < 1.5 { t } else { -t }).collect();
    let mut out = vec![None; log.len()];
    local_polynomial(fit(11, 2, 1), &times, &log, &mut out).unwrap();
    assert_eq!(out[10], None);
    for (t, y) in times.iter().zip(&out).filter(|(_, y)| y.is_some()) {
        let truth = if *t < 1.5 { 1.0 } else { -1.0 };
        assert!(abs_diff_eq!(y.unwrap(), truth, epsilon = tolerance::LOCAL_RATE), "{t}: {y:?}");
    }
    assert_eq!(out.iter().flatten().count(), 20);
}

#[test]
fn central_differences_are_exact_on_a_parabola() {
    let log: Vec<f64> = (0..9).map(|n| 3.0 + (n as f64 / HZ).powi(2)).collect();
    let mut rate = [0.0; 9];
    central_difference(hundred(), &log, &mut rate).unwrap();
    for (n, y) in rate.iter().enumerate() {
        assert_abs_diff_eq!(*y, 2.0 * n as f64 / HZ, epsilon = tolerance::LOCAL_VALUE);
    }
    let mut two = [0.0_f32; 2];
    central_difference(hundred(), &[1.0, 1.5], &mut two).unwrap();
    assert_eq!(two, [50.0, 50.0]);
}

#[test]
fn log_errors_carry_the_evidence() {
    let hz = hundred();
    let mut one = [0.0];
    assert_eq!(
        central_difference(hz, &[1.0], &mut one),
        Err(FilterError::TooShort { needed: 2, got: 1 })
    );
    assert_eq!(
        central_difference(hz, &[1.0, 2.0], &mut one),
        Err(FilterError::LengthsDiffer { log: 2, other: 1 })
    );
    let sg = SgFilter::<f64, 8>::new(SgShape::rate(3, 1), hz).unwrap();
    assert_eq!(
        sg.over_log(&[1.0, f64::NAN, 2.0], &mut [0.0; 3]),
        Err(FilterError::NotFinite { index: 1 })
    );
    let grid = Grid { start: Seconds(-0.5), sample_rate: hz };
    let outside = resample(&[0.0, 1.0], &[0.0, 1.0], grid, Between::Linear, &mut [0.0; 3]);
    assert_eq!(outside, Err(FilterError::OutsideLog { time_s: -0.5, first_s: 0.0, last_s: 1.0 }));
    assert!(outside.unwrap_err().to_string().contains("-0.5 s is outside the log"));
    let even_window = fit(4, 2, 1);
    assert!(local_polynomial(even_window, &[0.0], &[0.0], &mut [None]).is_err());
}
