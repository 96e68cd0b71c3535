//! The receptor over converter codes against the receptor over volts, in `f64`.

use approx::abs_diff_eq;
use proptest::{collection::vec, prelude::*};
use stretch_core::{
    Branch, Calibration, Model, Polarity, RateEstimator, Runner, Stage, Target, Volts,
};
use stretch_filter::SgRate;
use stretch_receptor::{
    Domain, StretchReceptor, Withheld,
    code::{Adc, AdcCode, AdcSpec, FixedCalibration, FixedReceptor},
    example_calibration,
};

fn due() -> Adc {
    Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 }).unwrap()
}

/// Full scale of the calibration's target, in thousandths of the reference's unit.
fn full_scale(calibration: &Calibration) -> f64 {
    1000.0
        * (calibration.spec().target.reference_per_target()
            * calibration.spec().target_range.span())
        .abs()
}

type Exact = StretchReceptor<f64, SgRate<f64, 11, 2>>;

fn exact(calibration: &Calibration) -> Exact {
    let rate = SgRate::new(calibration.spec().sample_rate_hz).unwrap();
    StretchReceptor::with_rate(calibration, rate).unwrap()
}

/// Result of a comparison of two receptors.
#[derive(Debug, Default)]
struct Compared {
    readings: usize,
    clamped: usize,
    worst: f64,
}

/// Runs both receptors over `codes` and checks that they agree in everything except the estimate. Returns the largest
/// difference of the estimates, in thousandths.
fn compare(
    calibration: &Calibration,
    adc: &Adc,
    codes: &[i32],
    fixed: &FixedReceptor<11, 2>,
) -> Result<Compared, String> {
    let mut found = Compared::default();
    let (mut fixed, mut float) = (Runner::new(*fixed), Runner::new(exact(calibration)));
    let mut rate =
        Runner::new(SgRate::<f64, 11, 2>::new(calibration.spec().sample_rate_hz).unwrap());
    for (n, &code) in codes.iter().enumerate() {
        let volts = adc.volts(AdcCode(code));
        let rate = volts.and_then(|volts| rate.step(volts));
        let ours = fixed.step(AdcCode(code));
        let theirs = float.step(Volts(volts.unwrap_or(f64::NAN)));
        let (ours, theirs) = match (ours, theirs) {
            (Ok(ours), Ok(theirs)) => (ours, theirs),
            (Err(ours), Err(theirs)) if ours == theirs => continue,
            (ours, theirs) => return Err(format!("sample {n}: {:?} {theirs:?}", ours.is_ok())),
        };
        if ours.branch != theirs.branch {
            // exactly at the edge of the dead band, rounding decides which branch the float receptor chooses
            let tie = rate.is_some_and(|r| (r.abs() - calibration.spec().dead_band).abs() < 1e-9);
            return if tie { Ok(found) } else { Err(format!("sample {n}: branch")) };
        }
        if ours.domain != theirs.domain && !at_an_end(calibration, ours.branch, rate, volts) {
            return Err(format!("sample {n}: {:?}, {:?}", ours.domain, theirs.domain));
        }
        found.readings += 1;
        found.clamped += usize::from(ours.domain != Domain::Inside);
        found.worst = found.worst.max((f64::from(ours.estimate) - 1000.0 * theirs.estimate).abs());
    }
    Ok(found)
}

/// Whether an input equals an end of the domain within the rounding of `f64`. The integers are exact there, whereas
/// rounding may put the floats on either side.
fn at_an_end(
    calibration: &Calibration,
    branch: Branch,
    rate: Option<f64>,
    volts: Option<f64>,
) -> bool {
    let near = |x: Option<f64>, end: f64| x.is_some_and(|x| (x - end).abs() < 1e-9);
    let sign = calibration.spec().polarity.sign();
    match &calibration.spec().model {
        Model::Surfaces { inflation, deflation } => {
            let surface = if branch == Branch::Inflation { inflation } else { deflation };
            let (signal, ends) = (surface.signal_domain, surface.rate_domain);
            near(volts, signal.min)
                || near(volts, signal.max)
                || near(rate, sign * ends.min)
                || near(rate, sign * ends.max)
        }
        Model::Linear(line) => {
            near(volts, line.signal_domain.min) || near(volts, line.signal_domain.max)
        }
        _ => false,
    }
}

/// Eleven codes that end at `code` after a ramp of `slope` codes a sample with some bend.
fn ramp(code: i32, slope: f64, bend: f64) -> Vec<i32> {
    let at = |lag: i32| {
        let lag = f64::from(lag);
        (f64::from(code) - slope * lag + bend * lag * lag).round().clamp(0.0, 4095.0) as i32
    };
    (0..=10).rev().map(at).collect()
}

/// Slopes of ramps, in codes per sample: from rest to beyond the rates to which the example's
/// surfaces were fitted (8 V/s is 99 codes per sample), and steps that are faster than any muscle.
const SLOPES: [f64; 23] = [
    0.0, 0.05, -0.05, 0.2, -0.2, 0.3, -0.3, 1.0, -1.0, 4.0, -4.0, 13.0, -13.0, 35.0, -35.0, 60.0,
    -60.0, 90.0, -90.0, 130.0, -130.0, 400.0, -400.0,
];

#[test]
fn every_code_at_every_rate_is_within_a_hundredth_of_a_percent() {
    let (calibration, adc) = (example_calibration(), due());
    let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc).unwrap();
    let stated = fixed.worst_case_error_um();
    let receptor = FixedReceptor::new(fixed);
    let mut total = Compared::default();
    for code in 0..4096 {
        for slope in SLOPES {
            for bend in [0.0, 0.7] {
                let codes = ramp(code, slope, bend);
                let found = compare(&calibration, &adc, &codes, &receptor).unwrap();
                total.readings += found.readings;
                total.clamped += found.clamped;
                total.worst = total.worst.max(found.worst);
            }
        }
    }
    println!("{total:?}, stated {stated}");
    assert_eq!(total.readings, 4096 * SLOPES.len() * 2);
    assert!(total.clamped > 10_000 && total.clamped < total.readings / 2 * 2 - 10_000);
    assert!(total.worst <= stated, "{total:?}, stated {stated}");
    assert!(total.worst > 0.49, "a rounding to micrometres must show");
    assert!(stated <= 1e-4 * full_scale(&calibration), "stated {stated}");
}

/// Calibrations, linear or poly13, whose rate estimator is the eleven-point parabola.
fn calibration() -> impl Strategy<Value = Calibration> {
    let surface = || stretch_strategies::surface_of(stretch_core::Degree::POLY13);
    (stretch_strategies::paper_calibration(), surface(), surface(), 60.0..400.0).prop_map(
        |(calibration, up, down, rest_length)| {
            let mut spec = calibration.into_spec();
            spec.rate_estimator = RateEstimator::SAVGOL_11_2;
            // a resolution of a thousandth is fine enough for references in millimetres or degrees
            spec.target = Target::Contraction { rest_length };
            if let Model::Surfaces { inflation, deflation } = &mut spec.model {
                (inflation.surface, deflation.surface) = (up, down);
            }
            Calibration::new(spec).unwrap()
        },
    )
}

fn adc() -> impl Strategy<Value = Adc> {
    (8..=16u8, -3.0..0.5f64, 2.0..5.0f64).prop_map(|(bits, zero_v, full_scale_v)| {
        Adc::new(AdcSpec { bits, zero_v, full_scale_v }).unwrap()
    })
}

/// Codes that drift, jump, stick at the ends, and sometimes are not codes.
fn codes(bits: u8, lost: bool) -> impl Strategy<Value = Vec<i32>> {
    let full = 1i32 << bits;
    let wander = move |start: i32, steps: Vec<i32>| -> Vec<i32> {
        let mut at = start;
        let step = |step: i32| {
            at = (at + step * full / 4096).clamp(0, full - 1);
            at
        };
        steps.into_iter().map(step).collect()
    };
    let none = prop_oneof![Just(-1), Just(i32::MIN), Just(i32::MAX), Just(full), any::<i32>()];
    let piece = prop_oneof![
        4 => (0..full, vec(-60..60i32, 5..40)).prop_map(move |(start, steps)| wander(start, steps)),
        1 => (prop_oneof![Just(0), Just(full - 1)], 1..30usize).prop_map(|(x, n)| vec![x; n]),
        1 => vec(0..full, 1..20),
        u32::from(lost) => vec(none, 1..6),
    ];
    vec(piece, 1..8).prop_map(|pieces| pieces.concat())
}

fn case() -> impl Strategy<Value = (Calibration, Adc, Vec<i32>)> {
    (calibration(), adc()).prop_flat_map(|(calibration, adc)| {
        let codes = codes(adc.spec().bits, false);
        (Just(calibration), Just(adc), codes)
    })
}

proptest! {
    #[test]
    fn any_calibration_is_within_its_stated_error_or_refused((calibration, adc, codes) in case()) {
        let Ok(fixed) = FixedCalibration::<11, 2>::new(&calibration, &adc) else {
            return Ok(()); // counted in `most_calibrations_fit`
        };
        let stated = fixed.worst_case_error_um();
        prop_assert!(stated <= 1e-4 * full_scale(&calibration));
        let found = compare(&calibration, &adc, &codes, &FixedReceptor::new(fixed));
        let found = found.map_err(TestCaseError::fail)?;
        prop_assert!(found.worst <= stated, "{} > {stated}", found.worst);
    }

    #[test]
    fn missing_codes_are_bridged_as_missing_volts_are(
        codes in codes(12, true), falling: bool,
    ) {
        let mut spec = example_calibration().into_spec();
        spec.polarity = if falling { Polarity::Falling } else { Polarity::Rising };
        let (calibration, adc) = (Calibration::new(spec).unwrap(), due());
        let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc).unwrap();
        let (mut fixed, mut float) =
            (Runner::new(FixedReceptor::new(fixed)), Runner::new(exact(&calibration)));
        for code in codes {
            let volts = adc.volts(AdcCode(code)).unwrap_or(f64::NAN);
            let (ours, theirs) = (fixed.step(AdcCode(code)), float.step(Volts(volts)));
            prop_assert_eq!(ours.err(), theirs.err());
        }
    }

    #[test]
    fn a_bridge_inside_the_range_costs_sixteen_bits_of_rounding(
        start in 1500..2300i32, steps in vec(-12..12i32, 40), gap in 15..30usize, long in 1..4usize,
    ) {
        let (calibration, adc) = (example_calibration(), due());
        let fixed = FixedCalibration::<11, 2>::new(&calibration, &adc).unwrap();
        let mut at = start;
        let mut codes: Vec<i32> = steps.into_iter().map(|step| { at += step; at }).collect();
        codes[gap..gap + long].fill(-1);
        let (mut fixed, mut float) =
            (Runner::new(FixedReceptor::new(fixed)), Runner::new(exact(&calibration)));
        for code in codes {
            let volts = adc.volts(AdcCode(code)).unwrap_or(f64::NAN);
            let (ours, theirs) = (fixed.step(AdcCode(code)), float.step(Volts(volts)));
            prop_assert_eq!(ours.err(), theirs.err());
            if let (Ok(ours), Ok(theirs)) = (ours, theirs) {
                if ours.branch != theirs.branch {
                    break; // a rate within that rounding of the dead band
                }
                let (ours, theirs) = (f64::from(ours.estimate), 1000.0 * theirs.estimate);
                let near = abs_diff_eq!(ours, theirs, epsilon = testkit::tolerance::CODE_STEP_UM);
                prop_assert!(near, "{ours} {theirs}");
            }
        }
    }

    #[test]
    fn a_record_comes_back_and_answers_the_same((calibration, adc, codes) in case()) {
        let Ok(fixed) = FixedCalibration::<11, 2>::new(&calibration, &adc) else { return Ok(()) };
        let mut buffer = [0; 256];
        let bytes = postcard::to_slice(&fixed, &mut buffer).unwrap();
        let back: FixedCalibration<11, 2> = postcard::from_bytes(bytes).unwrap();
        prop_assert_eq!(back, fixed);
        prop_assert!(postcard::from_bytes::<FixedCalibration<11, 1>>(bytes).is_err(), "another shape");
        let mut one = Runner::new(FixedReceptor::new(fixed));
        let mut other = Runner::new(FixedReceptor::new(back));
        for code in codes {
            prop_assert_eq!(one.step(AdcCode(code)), other.step(AdcCode(code)));
        }
    }

    #[test]
    fn a_damaged_record_is_refused_or_harmless(
        damage in vec((any::<prop::sample::Index>(), any::<u8>()), 1..6), codes in vec(any::<i32>(), 60),
    ) {
        let fixed = FixedCalibration::<11, 2>::new(&example_calibration(), &due()).unwrap();
        let mut buffer = [0; 256];
        let bytes = postcard::to_slice(&fixed, &mut buffer).unwrap();
        for (at, value) in damage {
            bytes[at.index(bytes.len())] = value;
        }
        if let Ok(damaged) = postcard::from_bytes::<FixedCalibration<11, 2>>(bytes) {
            // the test profile panics on arithmetic overflow
            let mut receptor = Runner::new(FixedReceptor::new(damaged));
            for code in codes {
                let _ = receptor.step(AdcCode(code));
                let _ = receptor.step(AdcCode(code & 0xfff));
            }
        }
    }
}

#[test]
fn most_calibrations_fit_and_what_does_not_is_named() {
    use proptest::{strategy::ValueTree, test_runner::TestRunner};
    let mut runner = TestRunner::deterministic();
    let (mut fit, mut fields) = (0, std::collections::BTreeSet::new());
    for _ in 0..500 {
        let (calibration, adc, _) = case().new_tree(&mut runner).unwrap().current();
        match FixedCalibration::<11, 2>::new(&calibration, &adc) {
            Ok(_) => fit += 1,
            Err(error) => {
                let message = error.to_string();
                fields.insert(message.split(' ').next().unwrap_or_default().to_owned());
            }
        }
    }
    println!("{fit} of 500; {fields:?}");
    assert!(fit > 250, "{fit} of 500; {fields:?}");
}

#[test]
fn what_cannot_run_is_refused_by_name() {
    let message = |change: &dyn Fn(&mut stretch_core::CalibrationSpec)| {
        let mut spec = example_calibration().into_spec();
        change(&mut spec);
        let calibration = Calibration::new(spec).unwrap();
        FixedCalibration::<11, 2>::new(&calibration, &due()).unwrap_err().to_string()
    };
    let tracker = RateEstimator::Tracker { tracking_index: 0.1 };
    assert!(message(&|spec| spec.rate_estimator = tracker).contains("rate estimator is a tracker"));
    let longer = RateEstimator::SavitzkyGolay { window: 13, degree: 2, delay: 0 };
    assert!(message(&|spec| spec.rate_estimator = longer).contains("rate.window is 13"));
    // metres instead of millimetres: a thousandth is then a millimetre
    let metres = stretch_core::Target::Contraction { rest_length: 0.18 };
    assert!(message(&|spec| spec.target = metres).contains("fixed.error"));
    let kilometres = stretch_core::Target::Contraction { rest_length: 180e6 };
    assert!(message(&|spec| spec.target = kilometres).contains("fixed."));
}

#[test]
fn a_memory_starts_on_the_branch_it_is_told() {
    use stretch_core::Design;
    let fixed = FixedCalibration::<11, 2>::new(&example_calibration(), &due()).unwrap();
    let receptor = FixedReceptor::new(fixed);
    let mut memory = receptor.memory().starting_on(Branch::Deflation);
    for _ in 0..10 {
        assert_eq!(receptor.step(&mut memory, AdcCode(2000)), Err(Withheld::Warming));
    }
    assert_eq!(receptor.step(&mut memory, AdcCode(2000)).unwrap().branch, Branch::Deflation);
    assert_eq!(size_of_val(&memory), 60, "bytes a channel, as documented");
}
