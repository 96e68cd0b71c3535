//! Receptors with memory: readings are finite for any stream, both precisions agree, and an
//! observer inverts the gauge that it describes.

use approx::assert_abs_diff_eq;
use proptest::prelude::*;
use stretch_core::{
    Calibration, CalibrationSpec, DesignError, FitSummary, HistoryMap, HistoryShape, Interval,
    Model, ObserverMap, RateEstimator, RestTracker, Runner, Values, Volts, arithmetic::play,
};
use stretch_receptor::{
    HistoryReceptor, ObserverReceptor, Receptor, ReceptorError, StretchReceptor, Withheld,
    code::{Adc, AdcSpec, FixedCalibration, FixedObserver},
    example_calibration, example_diagnosed,
};

const FIT: FitSummary = FitSummary { samples: 9000, r_squared: 0.99, rmse: 0.01 };
const UNIT: Interval = Interval { min: 0.0, max: 1.0 };
const REST: RestTracker = RestTracker { level: 1.15, catch_up_s: 0.5, leak: 0.001 };

fn with(model: Model) -> Calibration {
    let spec = CalibrationSpec { model, ..example_calibration().into_spec() };
    Calibration::new(spec).expect("every part is in range")
}

fn observer(rest: Option<RestTracker>, amplitude: f64) -> Calibration {
    let curve: Vec<f64> = (0..=12).map(|k| 1.1 + 0.96 * (f64::from(k) / 12.0).powf(0.8)).collect();
    with(Model::Observer(ObserverMap {
        rest,
        curve: Values::new("curve", &curve).unwrap(),
        drive_domain: Interval { min: -0.1, max: 1.2 },
        relaxations_s: Values::new("taus", &[0.25]).unwrap(),
        amplitudes: Values::new("amplitudes", &[amplitude]).unwrap(),
        lead_s: 0.01,
        radii: Values::new("radii", &[0.05]).unwrap(),
        play_weights: Values::new("weights", &[-0.1]).unwrap(),
        noise: 0.005,
        agility: 10.0,
        estimate_domain: UNIT,
        fit: FIT,
    }))
}

fn history(rest: Option<RestTracker>, coefficients: &[f64]) -> Calibration {
    with(Model::History(HistoryMap {
        rest,
        relaxations_s: Values::new("taus", &[0.1, 0.4]).unwrap(),
        radii: Values::new("radii", &[0.1]).unwrap(),
        degree: 3,
        memory_degree: 3,
        state_min: Values::new("min", &[0.0, -0.2, -0.2, -0.1]).unwrap(),
        state_max: Values::new("max", &[1.0, 0.2, 0.2, 0.1]).unwrap(),
        coefficients: Values::new("coefficients", coefficients).unwrap(),
        estimate_domain: UNIT,
        fit: FIT,
    }))
}

const TERMS: usize = 35;

#[test]
fn shape_of_the_terms() {
    let shape = HistoryShape { states: 4, degree: 3, memory_degree: 3 };
    assert_eq!(shape.terms(), TERMS);
}

#[test]
fn an_estimate_that_is_limited_has_its_own_word() {
    let domain = |constant: f64| {
        let mut coefficients = [0.0; TERMS];
        coefficients[0] = constant;
        let calibration = history(None, &coefficients);
        let mut receptor = Runner::new(Receptor::<f64>::new(&calibration).unwrap());
        let readings = (0..40).map(|_| receptor.step(Volts(1.5)));
        readings.last().and_then(Result::ok).map(|reading| reading.domain.to_string())
    };
    assert_eq!(domain(0.5).as_deref(), Some("inside"));
    assert_eq!(domain(2.0).as_deref(), Some("estimate_clamped"));
}

proptest! {
    /// The memory of the sensor survives a gap in which the target rests: the estimates afterwards are those of a
    /// stream without the gap.
    #[test]
    fn a_gap_loses_no_memory(missing in 1_usize..300, moved in 20_usize..400) {
        let mut coefficients = [0.0; TERMS];
        (coefficients[0], coefficients[1], coefficients[2]) = (0.4, 0.4, 0.3);
        for calibration in [observer(None, 0.3), history(None, &coefficients), example_diagnosed()] {
            let mut whole = Runner::new(Receptor::<f64>::new(&calibration).unwrap());
            let mut broken = whole.clone();
            let volts = |n: usize| Volts(1.5 + 0.3 * (0.02 * n.min(moved) as f64).sin());
            for n in 0..moved + 100 {
                let _ = (whole.step(volts(n)), broken.step(volts(n)));
            }
            for _ in 0..missing {
                let _ = (whole.step(volts(moved)), broken.step(Volts(f64::NAN)));
            }
            for _ in 0..20 {
                let _ = (whole.step(volts(moved)), broken.step(volts(moved)));
            }
            let (known, found) = (whole.step(volts(moved)).unwrap(), broken.step(volts(moved)).unwrap());
            prop_assert!(
                (known.estimate - found.estimate).abs() < 0.1,
                "{}: {known:?} {found:?}", calibration.spec().model.name()
            );
        }
    }
}

fn rest() -> impl Strategy<Value = Option<RestTracker>> {
    prop_oneof![Just(None), Just(Some(REST))]
}

fn remembering() -> impl Strategy<Value = Calibration> {
    prop_oneof![
        (rest(), -0.3..0.6f64).prop_map(|(rest, amplitude)| observer(rest, amplitude)),
        (rest(), proptest::collection::vec(-2.0..2.0f64, TERMS))
            .prop_map(|(rest, coefficients)| history(rest, &coefficients)),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn readings_are_finite_whatever_comes(
        calibration in remembering(),
        stream in stretch_strategies::faulty_voltages(200),
    ) {
        let mut wide = Runner::new(Receptor::<f64>::new(&calibration).unwrap());
        let mut narrow = Runner::new(Receptor::<f32>::new(&calibration).unwrap());
        // the lengths of the normalised targets 0..1, with a margin for rounding
        let inside = |x: f64| !matches!(calibration.spec().model, Model::History(_) | Model::Observer(_))
            || (150.0..180.1).contains(&x);
        for &volts in &stream {
            if let Ok(reading) = wide.step(Volts(volts)) {
                prop_assert!(reading.estimate.is_finite() && reading.rate.is_finite());
                prop_assert!(inside(reading.estimate), "{}", reading.estimate);
            } else {
                prop_assert!(true);
            }
            if let Ok(reading) = narrow.step(Volts(volts as f32)) {
                prop_assert!(reading.estimate.is_finite() && reading.rate.is_finite());
            }
        }
    }

    /// Every model gives finite readings in both precisions. After a reset it answers as before,
    /// because nothing of a stream stays in the design.
    #[test]
    fn any_calibration_on_any_stream(
        calibration in stretch_strategies::calibration(),
        stream in stretch_strategies::faulty_voltages(120),
    ) {
        let mut wide = Runner::new(Receptor::<f64>::new(&calibration).unwrap());
        let mut narrow = Runner::new(Receptor::<f32>::new(&calibration).unwrap());
        let mut first = Vec::new();
        for &volts in &stream {
            let reading = wide.step(Volts(volts));
            if let Ok(reading) = &reading {
                prop_assert!(reading.estimate.is_finite() && reading.rate.is_finite());
            }
            first.push(reading);
            if let Ok(reading) = narrow.step(Volts(volts as f32)) {
                prop_assert!(reading.estimate.is_finite() && reading.rate.is_finite());
            }
        }
        wide.reset();
        for (&volts, before) in stream.iter().zip(&first) {
            prop_assert_eq!(&wide.step(Volts(volts)), before);
        }
    }

    #[test]
    fn both_precisions_agree(calibration in remembering(), stream in stretch_strategies::clean_voltages(300)) {
        let mut wide = Runner::new(Receptor::<f64>::new(&calibration).unwrap());
        let mut narrow = Runner::new(Receptor::<f32>::new(&calibration).unwrap());
        for &volts in &stream {
            let volts = f64::from(volts as f32);
            match (wide.step(Volts(volts)), narrow.step(Volts(volts as f32))) {
                (Ok(wide), Ok(narrow)) => {
                    // coefficients of either sign up to 2 in 35 terms, times a stroke of 30 mm
                    let error = (wide.estimate - f64::from(narrow.estimate)).abs();
                    prop_assert!(error < testkit::tolerance::REMEMBERING_F32_MM, "{error}");
                }
                (a, b) => prop_assert_eq!(a.err(), b.err()),
            }
        }
    }

    #[test]
    fn records_round_trip(calibration in remembering()) {
        let mut buffer = [0; 4096];
        let bytes = postcard::to_slice(&calibration, &mut buffer).unwrap();
        let back: Calibration = postcard::from_bytes(bytes).unwrap();
        prop_assert_eq!(&calibration, &back);
    }

    /// The signal is that of the observer's gauge model, without noise. The filter finds a smooth
    /// motion to a share of its stroke.
    #[test]
    fn an_observer_inverts_its_gauge(amplitude in -0.3..0.6f64, turns in 0.1..0.6f64) {
        let calibration = observer(None, amplitude);
        let Model::Observer(map) = &calibration.spec().model else { unreachable!() };
        let mut receptor = Runner::new(ObserverReceptor::<f64>::new(&calibration).unwrap());
        let share = -(-0.01f64 / 0.25).exp_m1();
        let omega = core::f64::consts::TAU * turns;
        let target = |n: usize| 0.5 - 0.4 * (omega * n as f64 * 0.01).cos();
        let (mut slow, mut played) = (target(0), target(0));
        for n in 0..1500 {
            let y = target(n);
            let rate = 0.4 * omega * (omega * n as f64 * 0.01).sin();
            slow += share * (y - slow);
            played = play(played, y, 0.05);
            let drive = y + 0.01 * rate + amplitude * (y - slow) - 0.1 * (y - played);
            let place = ((drive + 0.1) / 1.3 * 12.0).clamp(0.0, 11.999);
            let below = place as usize;
            let volts = map.curve[below] + (place - below as f64) * (map.curve[below + 1] - map.curve[below]);
            let reading = receptor.step(Volts(volts)).unwrap();
            if n > 300 {
                let truth = 180.0 * (1.0 - 0.165 * y);
                let error = (reading.estimate - truth).abs();
                prop_assert!(error < testkit::tolerance::OBSERVER_INVERTS_MM, "{n}: {error} mm");
            }
        }
    }
}

#[test]
fn one_lost_sample_costs_one_reading_and_a_long_gap_a_warm_up() {
    let mut receptor =
        Runner::new(HistoryReceptor::<f64>::new(&history(None, &[0.01; TERMS])).unwrap());
    let mut observer = Runner::new(ObserverReceptor::<f64>::new(&observer(None, 0.3)).unwrap());
    for _ in 0..30 {
        let _ = receptor.step(Volts(1.5));
        assert!(observer.step(Volts(1.5)).is_ok(), "an observer needs no warm-up");
    }
    assert_eq!(receptor.step(Volts(f64::NAN)), Err(Withheld::Missing));
    assert_eq!(observer.step(Volts(f64::NAN)), Err(Withheld::Missing));
    assert!(receptor.step(Volts(1.5)).is_ok() && observer.step(Volts(1.5)).is_ok());
    for _ in 0..10 {
        let _ = receptor.step(Volts(f64::NAN));
    }
    assert_eq!(receptor.step(Volts(1.5)), Err(Withheld::Warming));
}

#[test]
fn a_model_needs_its_own_receptor_and_hears_so() {
    let mismatch = |expected, found| {
        ReceptorError::Calibration(DesignError::Mismatch { field: "model", expected, found })
    };
    let (remembers, surfaces) = (observer(None, 0.3), example_calibration());
    let refused = StretchReceptor::<f64>::new(&remembers).unwrap_err();
    assert_eq!(refused, mismatch("linear or surfaces", "observer"));
    let refused = HistoryReceptor::<f64>::new(&remembers).unwrap_err();
    assert_eq!(refused, mismatch("history", "observer"));
    let refused = ObserverReceptor::<f64>::new(&surfaces).unwrap_err();
    assert_eq!(refused, mismatch("observer", "surfaces"));
    let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap();
    let refused = FixedObserver::new(&surfaces, &adc).unwrap_err();
    assert_eq!(refused, mismatch("observer", "surfaces"));
    let refused = FixedCalibration::<11, 2>::new(&remembers, &adc).unwrap_err();
    assert_eq!(refused, mismatch("linear or surfaces", "observer"));
    let tracked = RateEstimator::Tracker { tracking_index: 0.1 };
    let spec = CalibrationSpec { rate_estimator: tracked, ..surfaces.into_spec() };
    let refused = FixedCalibration::<11, 2>::new(&Calibration::new(spec).unwrap(), &adc);
    assert_eq!(
        refused.unwrap_err().to_string(),
        "the calibration's rate estimator is a tracker, but Savitzky-Golay is needed here"
    );
}

#[test]
fn a_resting_baseline_is_found() {
    let mut receptor =
        Runner::new(ObserverReceptor::<f64>::new(&observer(Some(REST), 0.0)).unwrap());
    let mut last = 0.0;
    for n in 0..3000 {
        // rest at 1.15 V, drifting down by 0.1 V
        let volts = 1.15 - 0.1 * f64::from(n.min(1500)) / 1500.0;
        last = receptor.step(Volts(volts)).unwrap().estimate;
    }
    let mut fresh = Runner::new(ObserverReceptor::<f64>::new(&observer(Some(REST), 0.0)).unwrap());
    let mut rested = 0.0;
    for _ in 0..3000 {
        rested = fresh.step(Volts(1.15)).unwrap().estimate;
    }
    assert_abs_diff_eq!(last, rested, epsilon = testkit::tolerance::REST_FOUND_MM);
}
