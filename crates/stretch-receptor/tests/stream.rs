//! The receptor on clean and faulty streams.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use proptest::prelude::*;
use stretch_core::{
    Branch, Calibration, Degree, Design, Model, Polarity, RateEstimator, Runner, SampleRate, Stage,
    Surface, Volts,
};
use stretch_filter::{IntegerSgRate, RateFilter, SgRate};
use stretch_receptor::{
    Domain, MAX_BRIDGED, Reading, Receptor, ReceptorError, StretchReceptor, Withheld,
    example_calibration,
};
use testkit::tolerance;

fn receptor() -> Runner<StretchReceptor<f64>> {
    Runner::new(StretchReceptor::new(&example_calibration()).unwrap())
}

/// The pipeline as described in the paper of the published method, without folding.
fn by_hand(calibration: &Calibration, branch: Branch, rate: f64, volts: f64) -> (f64, bool) {
    let signal = calibration.spec().signal_range;
    let (normalised, inside) = match &calibration.spec().model {
        Model::Linear(line) => {
            let v = volts.clamp(line.signal_domain.min, line.signal_domain.max);
            (line.intercept + line.slope * signal.normalise(v), v == volts)
        }
        Model::Surfaces { inflation, deflation } => {
            let s = if branch == Branch::Inflation { inflation } else { deflation };
            let signed = calibration.spec().polarity.sign() * rate;
            let v = volts.clamp(s.signal_domain.min, s.signal_domain.max);
            let r = signed.clamp(s.rate_domain.min, s.rate_domain.max);
            let inside = v == volts && r == signed;
            (s.surface.eval(s.rate_range.normalise(r), signal.normalise(v)), inside)
        }
        _ => unreachable!("the strategies make no other model"),
    };
    (
        calibration
            .spec()
            .target
            .to_reference(calibration.spec().target_range.denormalise(normalised)),
        inside,
    )
}

proptest! {
    #[test]
    fn folded_equals_the_paper_written_out(
        calibration in stretch_strategies::paper_calibration(), stream in stretch_strategies::clean_voltages(80),
    ) {
        let receptor = StretchReceptor::<f64>::new(&calibration).unwrap();
        let rates = RateFilter::<f64>::new(calibration.spec().rate_estimator, calibration.spec().sample_rate_hz).unwrap();
        let (mut memory, mut rate_memory) = (receptor.memory(), rates.memory());
        let mut branch = Branch::Inflation;
        for &volts in &stream {
            let reading = receptor.step(&mut memory, Volts(volts));
            let rate = match rates.step(&mut rate_memory, volts) {
                Some(rate) => rate,
                None if calibration.spec().model.needs_signal_only() => 0.0,
                None => {
                    prop_assert_eq!(reading, Err(Withheld::Warming));
                    continue;
                }
            };
            let reading = reading.unwrap();
            branch = branch.next(calibration.spec().polarity.sign() * rate, calibration.spec().dead_band);
            prop_assert_eq!(reading.branch, branch);
            let (estimate, inside) = by_hand(&calibration, branch, rate, volts);
            prop_assert_eq!(reading.domain == Domain::Inside, inside);
            let scale = calibration.spec().target.reference_per_target().abs().max(1.0);
            let difference = (reading.estimate - estimate).abs();
            prop_assert!(difference <= tolerance::FOLDED * scale, "{} {}", reading.estimate, estimate);
        }
    }

    #[test]
    fn any_stream_gives_finite_readings(
        calibration in stretch_strategies::paper_calibration(), stream in stretch_strategies::faulty_voltages(200),
    ) {
        let mut wide = Runner::new(StretchReceptor::<f64>::new(&calibration).unwrap());
        let mut narrow = Runner::new(StretchReceptor::<f32>::new(&calibration).unwrap());
        for &volts in &stream {
            if let Ok(Reading { estimate, rate, .. }) = wide.step(Volts(volts)) {
                prop_assert!(estimate.is_finite() && rate.is_finite(), "{volts}: {estimate} {rate}");
            }
            if let Ok(Reading { estimate, rate, .. }) = narrow.step(Volts(volts as f32)) {
                prop_assert!(estimate.is_finite() && rate.is_finite(), "{volts}: {estimate} {rate}");
            }
        }
    }

    #[test]
    fn a_fixed_shape_gives_the_same_bits(stream in stretch_strategies::faulty_voltages(120)) {
        let calibration = example_calibration();
        let rate = SgRate::<f64, 11, 2>::new(SampleRate::new(100.0).unwrap()).unwrap();
        let mut fixed = Runner::new(StretchReceptor::with_rate(&calibration, rate).unwrap());
        let mut general = receptor();
        for &volts in &stream {
            prop_assert_eq!(fixed.step(Volts(volts)), general.step(Volts(volts)));
        }
    }

    #[test]
    fn a_mirrored_signal_gives_the_same_estimate(stream in stretch_strategies::clean_voltages(120)) {
        // the signal is mirrored about its offset and the odd powers change sign: the same physics with a gauge whose
        // signal falls as the muscle contracts
        let rising = example_calibration();
        let mut spec = rising.clone().into_spec();
        let about = 2.0 * spec.signal_range.offset();
        spec.polarity = Polarity::Falling;
        let Model::Surfaces { inflation, deflation } = &mut spec.model else { unreachable!() };
        for branch in [inflation, deflation] {
            let degree = branch.surface.degree();
            let odd = |(i, j): (u8, u8)| {
                let sign = if j % 2 == 1 { -1.0 } else { 1.0 };
                sign * branch.surface.coefficient(i, j)
            };
            let flipped: Vec<f64> = degree.exponents().map(odd).collect();
            branch.surface = stretch_core::Surface::new(degree, &flipped).unwrap();
            let domain = branch.signal_domain;
            branch.signal_domain.min = about - domain.max;
            branch.signal_domain.max = about - domain.min;
        }
        let falling = Calibration::new(spec).unwrap();
        let mut one = Runner::new(StretchReceptor::<f64>::new(&rising).unwrap());
        let mut other = Runner::new(StretchReceptor::<f64>::new(&falling).unwrap());
        for &volts in &stream {
            if let (Ok(a), Ok(b)) = (one.step(Volts(volts)), other.step(Volts(about - volts))) {
                // at the limit of the dead band, a rounding error may select the other branch
                if a.branch == b.branch {
                    let (length, rate) = (180.0 * tolerance::FOLDED, 1e6 * tolerance::FOLDED);
                    prop_assert!(abs_diff_eq!(a.estimate, b.estimate, epsilon = length));
                    prop_assert!(abs_diff_eq!(a.rate, b.rate, epsilon = rate));
                }
            }
        }
    }
}

#[test]
fn the_window_fills_before_the_first_reading() {
    let mut receptor = receptor();
    for _ in 0..10 {
        assert_eq!(receptor.step(Volts(1.5)), Err(Withheld::Warming));
    }
    let reading = receptor.step(Volts(1.5)).unwrap();
    assert_eq!(reading.rate, 0.0);
    assert_eq!(reading.branch, Branch::Inflation);
}

/// A line needs no rate, and one curve for both branches needs none either. Therefore they have an estimate at the
/// first sample after a long gap.
#[test]
fn what_needs_the_signal_only_answers_from_the_first_sample() {
    let mut spec = example_calibration().into_spec();
    let Model::Surfaces { inflation, deflation } = &mut spec.model else { unreachable!() };
    inflation.surface = Surface::new(Degree::new(0, 2).unwrap(), &[0.02, 0.8, 0.3]).unwrap();
    *deflation = *inflation;
    for calibration in [Calibration::new(spec).unwrap(), crate::firmware::linear()] {
        let mut receptor = Runner::new(StretchReceptor::<f64>::new(&calibration).unwrap());
        let (known, inside) = by_hand(&calibration, Branch::Inflation, 0.0, 1.5);
        assert!(inside);
        for missing in [0, 1, 2 * MAX_BRIDGED] {
            (0..missing).for_each(|_| assert!(receptor.step(Volts(f64::NAN)).is_err()));
            let Reading { estimate, rate, .. } = receptor.step(Volts(1.5)).unwrap();
            assert_abs_diff_eq!(estimate, known, epsilon = 180.0 * tolerance::FOLDED);
            assert_eq!(rate, 0.0);
        }
    }
}

#[test]
fn a_stream_known_to_begin_contracted_starts_on_deflation() {
    let design = StretchReceptor::<f64>::new(&example_calibration()).unwrap();
    let mut memory = design.memory().starting_on(Branch::Deflation);
    let last = (0..11).map(|_| design.step(&mut memory, Volts(1.9))).last();
    assert_eq!(last.unwrap().unwrap().branch, Branch::Deflation);
}

#[test]
fn a_short_gap_costs_its_own_samples_only() {
    let mut receptor = receptor();
    let ramp = |n: u32| 1.3 + 0.002 * f64::from(n);
    for n in 0..20 {
        let _ = receptor.step(Volts(ramp(n)));
    }
    for _ in 0..MAX_BRIDGED {
        assert_eq!(receptor.step(Volts(f64::NAN)), Err(Withheld::Missing));
    }
    let after = receptor.step(Volts(ramp(20 + u32::from(MAX_BRIDGED)))).unwrap();
    let mut unbroken = self::receptor();
    let whole = (0..=20 + u32::from(MAX_BRIDGED)).map(|n| unbroken.step(Volts(ramp(n)))).last();
    // on a straight ramp the bridge predicts every lost sample
    let whole = whole.unwrap().unwrap().estimate;
    assert_abs_diff_eq!(after.estimate, whole, epsilon = 180.0 * tolerance::FOLDED);
}

#[test]
fn a_long_gap_starts_the_warm_up_and_keeps_the_branch() {
    let design = StretchReceptor::<f64>::new(&example_calibration()).unwrap();
    let mut memory = design.memory();
    for n in 0..30 {
        let _ = design.step(&mut memory, Volts(2.0 - 0.01 * f64::from(n)));
    }
    assert_eq!(memory.branch(), Branch::Deflation);
    for _ in 0..=MAX_BRIDGED {
        assert_eq!(design.step(&mut memory, Volts(f64::INFINITY)), Err(Withheld::Missing));
    }
    for _ in 0..10 {
        assert_eq!(design.step(&mut memory, Volts(1.7)), Err(Withheld::Warming));
    }
    assert_eq!(design.step(&mut memory, Volts(1.7)).unwrap().branch, Branch::Deflation);
}

#[test]
fn a_reset_forgets_everything() {
    let mut receptor = receptor();
    let first: Vec<_> = (0..40).map(|n| receptor.step(Volts(1.3 + 0.01 * f64::from(n)))).collect();
    receptor.reset();
    let second: Vec<_> = (0..40).map(|n| receptor.step(Volts(1.3 + 0.01 * f64::from(n)))).collect();
    assert_eq!(first, second);
}

#[test]
fn outside_the_domain_it_clamps_and_says_so() {
    let mut receptor = receptor();
    let settle = |receptor: &mut Runner<StretchReceptor<f64>>, volts| {
        (0..30).map(|_| receptor.step(Volts(volts))).last().unwrap().unwrap()
    };
    let edge = settle(&mut receptor, 2.06);
    receptor.reset();
    let beyond = settle(&mut receptor, 3.3);
    assert_eq!(edge.domain, Domain::Inside);
    assert_eq!(beyond.domain, Domain::SignalClamped);
    assert_eq!(edge.estimate, beyond.estimate);
    // twelve volts a second is faster than the fitted rates, which end at eight
    receptor.reset();
    let fast = (0..12).map(|n| receptor.step(Volts(1.1 + 0.06 * f64::from(n)))).last().unwrap();
    assert_eq!(fast.unwrap().domain, Domain::Inside);
    receptor.reset();
    let faster = (0..12).map(|n| receptor.step(Volts(0.75 + 0.1 * f64::from(n)))).last().unwrap();
    assert_eq!(faster.unwrap().domain, Domain::RateClamped);
}

#[test]
fn the_memory_of_a_channel_is_as_documented() {
    type Fixed<T> = StretchReceptor<T, SgRate<T, 11, 2>>;
    assert_eq!(size_of::<<Fixed<f64> as Design>::Memory>(), 120);
    assert_eq!(size_of::<<Fixed<f32> as Design>::Memory>(), 72);
}

/// A surface is valid only with the estimator of its fit: another window, degree, kind or sample rate is refused.
#[test]
fn a_rate_estimator_that_the_calibration_does_not_name_is_refused() {
    let calibration = example_calibration();
    let (hz, other) = (calibration.spec().sample_rate_hz, SampleRate::new(50.0).unwrap());
    let refused = |error: Option<ReceptorError>| assert_eq!(error, Some(ReceptorError::Rate));
    let short = SgRate::<f32, 9, 2>::new(hz).unwrap();
    refused(StretchReceptor::<f32, _>::with_rate(&calibration, short).err());
    let degree = IntegerSgRate::<11, 1>::new(hz, 3.3).unwrap();
    refused(StretchReceptor::<f32, _>::with_rate(&calibration, degree).err());
    let slow = SgRate::<f32, 11, 2>::new(other).unwrap();
    refused(StretchReceptor::<f32, _>::with_rate(&calibration, slow).err());
    let tracker = RateFilter::<f64>::new(RateEstimator::Tracker { tracking_index: 0.1 }, hz);
    refused(Receptor::<f64, _>::with_rate(&calibration, tracker.unwrap()).err());
    assert!(StretchReceptor::<f64, ()>::with_rate(&calibration, ()).is_ok());
}
