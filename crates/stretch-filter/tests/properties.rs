//! Property tests that must hold for every signal.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use proptest::prelude::*;
use stretch_core::{Hertz, RateEstimator, Runner, SampleRate, Stage};
use stretch_filter::{
    Biquad, BiquadSpec, Differentiator, FilterError, LowPass, LowPassSpec, MAX_SG_DEGREE,
    RateFilter, SgFilter, SgRate, SgShape, SgSmooth, Tracker, TrackerSpec,
};
use stretch_strategies::Signal;
use testkit::tolerance;

const HZ: f64 = 100.0;

fn hundred() -> SampleRate {
    SampleRate::new(HZ).unwrap()
}

fn spec(cutoff_hz: f64) -> LowPassSpec {
    LowPassSpec { cutoff: Hertz(cutoff_hz), sample_rate: hundred() }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, v| v.abs().max(m))
}

/// Any shape that a window of up to 40 samples can have.
fn shape() -> impl Strategy<Value = SgShape> {
    (2_usize..=40)
        .prop_flat_map(|window| (Just(window), 0..=(window - 1).min(5), 0..window))
        .prop_flat_map(|(window, degree, delay)| {
            (0..=degree.min(2)).prop_map(move |order| SgShape { window, degree, order, delay })
        })
}

fn live_estimator() -> impl Strategy<Value = RateEstimator> {
    prop_oneof![
        shape().prop_filter("a rate", |s| s.degree >= 1).prop_map(|s| {
            RateEstimator::SavitzkyGolay {
                window: s.window as u16,
                degree: s.degree as u8,
                delay: s.delay as u16,
            }
        }),
        (0.2..49.0).prop_map(|cutoff_hz| RateEstimator::Differentiator { cutoff_hz }),
        (-3.0..2.0_f64).prop_map(|e| RateEstimator::Tracker { tracking_index: 10_f64.powf(e) }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn savitzky_golay_is_exact_on_polynomials(
        shape in shape(), coefficients in prop::collection::vec(-10.0..10.0, 6),
    ) {
        // Time is measured in window lengths. The polynomials are then equally difficult for every window.
        let span_s = shape.window as f64 / HZ;
        let signal = Signal::Polynomial(coefficients[..=shape.degree].to_vec());
        let derivative = |u: f64| match (&signal, shape.order) {
            (_, 0) => signal.value(u),
            (_, 1) => signal.rate(u) / span_s,
            (Signal::Polynomial(c), _) => {
                let second = c.iter().enumerate().skip(2)
                    .map(|(k, c)| c * (k * (k - 1)) as f64 * u.powi(k as i32 - 2));
                second.sum::<f64>() / (span_s * span_s)
            }
            _ => unreachable!("a polynomial"),
        };
        let filter = SgFilter::<f64, 40>::new(shape, hundred()).unwrap();
        let u = |n: usize| n as f64 / shape.window as f64 - 1.0;
        let log: Vec<f64> = (0..2 * shape.window).map(|n| signal.value(u(n))).collect();
        let truth: Vec<f64> = (0..log.len()).map(|n| derivative(u(n))).collect();
        let taps: f64 = filter.taps().iter().map(|t| t.abs()).sum();
        let bound = tolerance::TAPS * (taps * largest(&log) + largest(&truth));

        let mut whole = vec![0.0; log.len()];
        filter.over_log(&log, &mut whole).unwrap();
        // At the ends the fit is evaluated off centre, where its taps may be larger.
        let end = SgShape { delay: 0, ..shape };
        let end = SgFilter::<f64, 40>::new(end, hundred()).unwrap();
        let end_taps: f64 = end.taps().iter().map(|t| t.abs()).sum();
        let end_bound = tolerance::TAPS * (end_taps * largest(&log) + largest(&truth));
        for (y, t) in whole.iter().zip(&truth) {
            prop_assert!(abs_diff_eq!(y, t, epsilon = end_bound.max(bound)), "{y} against {t}");
        }

        let mut runner = Runner::new(filter);
        for (n, &x) in log.iter().enumerate() {
            let y = runner.step(x);
            prop_assert_eq!(y.is_some(), n + 1 >= shape.window);
            if let Some(y) = y {
                assert_abs_diff_eq!(y, truth[n - shape.delay], epsilon = bound);
                // The live step and the pass over a log give the same bits.
                prop_assert_eq!(y, whole[n - shape.delay]);
            }
        }
    }

    #[test]
    fn the_delay_is_that_of_a_bending_signal(estimator in live_estimator(), bend in 0.1..5.0_f64) {
        let design = RateFilter::<f64>::new(estimator, hundred()).unwrap();
        let mut runner = Runner::new(design);
        // x = bend t^2 / 2, so the rate is bend t. An estimate with a delay d gives bend (t - d).
        let settled = 4 * design.warm_up() + 50;
        let mut last = None;
        for n in 0..=settled {
            let t = n as f64 / HZ;
            last = runner.step(0.5 * bend * t * t);
        }
        let t = settled as f64 / HZ;
        let delay_s = t - last.unwrap() / bend;
        let within = tolerance::RATE_FROM_DIFFERENCES * (1.0 + t * t);
        assert_abs_diff_eq!(delay_s, design.delay_s(), epsilon = within);
    }

    #[test]
    fn a_ramp_is_read_without_bias_once_warm(
        estimator in live_estimator(), slope in -5.0..5.0_f64, offset in -10.0..10.0,
    ) {
        let design = RateFilter::<f64>::new(estimator, hundred()).unwrap();
        let mut runner = Runner::new(design);
        let warm_up = design.warm_up();
        let mut rate = None;
        for n in 0..(8 * warm_up + 20) {
            rate = runner.step(offset + slope * n as f64 / HZ);
            prop_assert_eq!(rate.is_some(), n >= warm_up);
            if let Some(rate) = rate {
                // The differentiator has settled to 1 %, the others are exact.
                let within = tolerance::WARMED_UP * slope.abs() + tolerance::RATE_FROM_DIFFERENCES;
                assert_abs_diff_eq!(rate, slope, epsilon = within);
            }
        }
        let within = tolerance::RATE_FROM_DIFFERENCES * (1.0 + slope.abs());
        assert_abs_diff_eq!(rate.unwrap(), slope, epsilon = within);
    }

    #[test]
    fn every_live_estimator_is_linear(
        estimator in live_estimator(), gain in -3.0..3.0_f64,
        (a, b) in (stretch_strategies::sines(10.0), stretch_strategies::sines(10.0)),
    ) {
        let design = RateFilter::<f64>::new(estimator, hundred()).unwrap();
        let count = design.warm_up() + 60;
        let (a, b) = (a.samples(count, 1.0 / HZ), b.samples(count, 1.0 / HZ));
        let (mut ra, mut rb, mut rab) = (Runner::new(design), Runner::new(design), Runner::new(design));
        for (&a, &b) in a.iter().zip(&b) {
            let (ya, yb, yab) = (ra.step(a), rb.step(b), rab.step(a + gain * b));
            prop_assert_eq!(ya.is_some(), yab.is_some());
            if let (Some(ya), Some(yb), Some(yab)) = (ya, yb, yab) {
                let bound = tolerance::SUPERPOSITION * (ya.abs() + yb.abs() * gain.abs() + design.noise_gain() * 50.0);
                assert_abs_diff_eq!(yab, ya + gain * yb, epsilon = bound);
            }
        }
    }

    #[test]
    fn faulty_samples_never_enter_a_memory(
        estimator in live_estimator(), stream in stretch_strategies::faulty_stream(200),
    ) {
        let design = RateFilter::<f64>::new(estimator, hundred()).unwrap();
        let low_pass = spec(5.0).design::<f64, 4>().unwrap();
        let (mut all, mut clean) = (Runner::new(design), Runner::new(design));
        let (mut smooth, mut smooth_clean) = (Runner::new(low_pass), Runner::new(low_pass));
        for &x in &stream {
            let (rate, value) = (all.step(x), smooth.step(x));
            if x.abs() <= stretch_filter::LARGEST_SAMPLE {
                prop_assert_eq!(rate, clean.step(x));
                prop_assert_eq!(value, smooth_clean.step(x));
                prop_assert!(rate.is_none_or(f64::is_finite) && value.is_finite());
            } else {
                prop_assert!(rate.is_none() && value.is_nan());
            }
        }
        let mut single = Runner::new(RateFilter::<f32>::new(estimator, hundred()).unwrap());
        for &x in &stream {
            prop_assert!(single.step(x as f32).is_none_or(f32::is_finite));
        }
    }

    #[test]
    fn f32_follows_f64(signal in stretch_strategies::sines(8.0)) {
        let x = signal.samples(200, 1.0 / HZ);
        let (mut sg, mut sg32) = (
            Runner::new(SgRate::<f64, 11, 2>::new(hundred()).unwrap()),
            Runner::new(SgRate::<f32, 11, 2>::new(hundred()).unwrap()),
        );
        let (mut lp, mut lp32) = (
            Runner::new(spec(5.0).design::<f64, 4>().unwrap()),
            Runner::new(spec(5.0).design::<f32, 4>().unwrap()),
        );
        // The taps amplify the rounding of the samples, independent of the rate.
        let scale = largest(&x) * 50.0;
        for &x in &x {
            if let (Some(a), Some(b)) = (sg.step(x), sg32.step(x as f32)) {
                assert_abs_diff_eq!(a, f64::from(b), epsilon = tolerance::F32_FILTER * scale);
            }
            let (a, b) = (lp.step(x), lp32.step(x as f32));
            assert_abs_diff_eq!(a, f64::from(b), epsilon = tolerance::F32_FILTER * scale);
        }
    }

    #[test]
    fn a_settled_start_has_no_transient(x in -100.0..100.0_f64, cutoff_hz in 0.05..49.0) {
        let low_pass = spec(cutoff_hz).design::<f64, 5>().unwrap();
        let smooth = SgSmooth::<f64, 9, 2>::new(hundred()).unwrap();
        let rate = SgRate::<f64, 9, 2>::new(hundred()).unwrap();
        let biquad = low_pass.sections()[1];
        let mut memories =
            (low_pass.settled_at(x), smooth.settled_at(x), rate.settled_at(x), biquad.settled_at(x));
        // Errors decay at the rate of the slowest pole, so rounding may accumulate over 1/cutoff.
        let bound = tolerance::RECURSIVE_OUTPUT * x.abs().max(1.0);
        for _ in 0..200 {
            assert_abs_diff_eq!(low_pass.step(&mut memories.0, x), x, epsilon = bound);
            assert_abs_diff_eq!(smooth.step(&mut memories.1, x).unwrap(), x, epsilon = bound);
            assert_abs_diff_eq!(rate.step(&mut memories.2, x).unwrap(), 0.0, epsilon = bound);
            assert_abs_diff_eq!(biquad.step(&mut memories.3, x), x, epsilon = bound);
        }
    }

    #[test]
    fn cutoffs_above_the_stated_limit_are_built(part in -7.4..-0.31_f64) {
        let low = spec(HZ * 10_f64.powf(part));
        prop_assert!(low.design::<f64, 8>().is_ok());
        prop_assert!(Differentiator::<f64>::new(low).is_ok());
        if low.cutoff.0 >= HZ / 1500.0 {
            prop_assert!(low.design::<f32, 8>().is_ok());
            prop_assert!(Differentiator::<f32>::new(low).is_ok());
        }
    }

    #[test]
    fn any_record_is_built_or_refused(
        window in any::<u16>(), degree in any::<u8>(), delay in any::<u16>(),
        number in any::<f64>(), hz in 1e-12..1e12,
    ) {
        let rate = SampleRate::new(hz).unwrap();
        for estimator in [
            RateEstimator::SavitzkyGolay { window: window % 70, degree: degree % 14, delay: delay % 70 },
            RateEstimator::Differentiator { cutoff_hz: number },
            RateEstimator::Tracker { tracking_index: number },
        ] {
            if let Ok(design) = RateFilter::<f32>::new(estimator, rate) {
                prop_assert!(design.delay_s().is_finite() && design.noise_gain().is_finite());
                prop_assert!(design.warm_up() >= 1);
            }
        }
    }
}

/// Returns the amplitude of the response to a sine, by projection over a whole number of periods.
fn measured_gain<const N: usize>(filter: &LowPass<f64, N>, frequency_hz: f64) -> f64 {
    let mut memory = filter.settled_at(0.0);
    let w = std::f64::consts::TAU * frequency_hz / HZ;
    let (mut re, mut im) = (0.0, 0.0);
    let (settle, count) = (4000, 10_000);
    for n in 0..settle + count {
        let y = filter.step(&mut memory, (w * n as f64).sin());
        if n >= settle {
            re += y * (w * n as f64).cos();
            im += y * (w * n as f64).sin();
        }
    }
    2.0 * re.hypot(im) / count as f64
}

fn cutoff_is_minus_3_db<const N: usize>() {
    for cutoff_hz in [1.0, 5.0, 20.0, 40.0] {
        let gain = measured_gain(&spec(cutoff_hz).design::<f64, N>().unwrap(), cutoff_hz);
        assert!(
            abs_diff_eq!(
                gain,
                std::f64::consts::FRAC_1_SQRT_2,
                epsilon = tolerance::PROJECTED_GAIN
            ),
            "{N} {cutoff_hz}: {gain}"
        );
    }
}

#[test]
fn the_gain_at_the_cutoff_is_minus_3_db() {
    cutoff_is_minus_3_db::<1>();
    cutoff_is_minus_3_db::<2>();
    cutoff_is_minus_3_db::<3>();
    cutoff_is_minus_3_db::<8>();
}

/// Returns white noise of standard deviation 1, as sums of twelve uniform numbers.
fn noise(count: usize) -> Vec<f64> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
}

fn deviation(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn noise_gain_is_the_deviation_that_is_measured() {
    let x = noise(40_000);
    let estimators = [
        RateEstimator::SAVGOL_11_2,
        RateEstimator::SavitzkyGolay { window: 31, degree: 3, delay: 15 },
        RateEstimator::Differentiator { cutoff_hz: 3.0 },
        RateEstimator::Differentiator { cutoff_hz: 20.0 },
        RateEstimator::Tracker { tracking_index: 0.03 },
        RateEstimator::Tracker { tracking_index: 2.0 },
    ];
    for estimator in estimators {
        let design = RateFilter::<f64>::new(estimator, hundred()).unwrap();
        let mut runner = Runner::new(design);
        let y: Vec<f64> = x.iter().filter_map(|&x| runner.step(x)).collect();
        let ratio = deviation(&y) / design.noise_gain();
        assert!(
            abs_diff_eq!(ratio, 1.0, epsilon = tolerance::MEASURED_DEVIATION),
            "{estimator:?}: {ratio}"
        );
    }
    let low_pass = spec(5.0).design::<f64, 3>().unwrap();
    let mut memory = low_pass.settled_at(0.0);
    let y: Vec<f64> = x.iter().map(|&x| low_pass.step(&mut memory, x)).collect();
    let ratio = deviation(&y) / low_pass.noise_gain();
    assert!(abs_diff_eq!(ratio, 1.0, epsilon = tolerance::MEASURED_DEVIATION), "{ratio}");
}

#[test]
fn what_cannot_work_is_refused_by_name() {
    let hz = hundred();
    let sg = |window, degree, delay| RateEstimator::SavitzkyGolay { window, degree, delay };
    let refuse = |estimator| RateFilter::<f32>::new(estimator, hz).unwrap_err();
    assert_eq!(refuse(RateEstimator::CentralDifference), FilterError::LooksAhead { samples: 1 });
    for (estimator, name) in [
        (sg(2, 2, 0), "degree"),
        (sg(11, 2, 11), "delay"),
        (sg(40, MAX_SG_DEGREE as u8 + 1, 0), "degree"),
        (sg(65, 2, 0), "window"),
        (RateEstimator::Differentiator { cutoff_hz: 50.0 }, "cutoff_hz"),
        (RateEstimator::Differentiator { cutoff_hz: f64::NAN }, "cutoff_hz"),
        (RateEstimator::Tracker { tracking_index: 0.0 }, "tracking_index"),
        // An f32 cannot hold poles this close to one.
        (RateEstimator::Differentiator { cutoff_hz: 0.001 }, "cutoff_hz"),
    ] {
        let message = refuse(estimator).to_string();
        assert!(message.contains(name), "{estimator:?}: {message}");
    }
    assert!(RateFilter::<f64, 8>::new(sg(9, 2, 0), hz).is_err());
    assert!(Differentiator::<f64>::new(spec(0.001)).is_ok());
    let slow = SampleRate::new(1e-10).unwrap();
    assert!(Tracker::<f64>::new(TrackerSpec { tracking_index: 1.0, sample_rate: slow }).is_err());
    let unstable = BiquadSpec { b0: 1.0, b1: 0.0, b2: 0.0, a1: -2.0, a2: 1.0 };
    assert!(Biquad::<f64>::new(unstable).is_err());
}
