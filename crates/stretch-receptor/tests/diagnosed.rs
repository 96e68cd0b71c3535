//! A gauge with named defects: the forward model agrees with the operators of the effects, and the receptor inverts it
//! with a realistic standard deviation.

use approx::assert_relative_eq;
use proptest::prelude::*;
use stretch_core::{
    Calibration, Crosstalk, Design, DiagnosedMap, Fading, Knee, Model, Plays, Stage, Volts, Worn,
};
use stretch_effects::{
    Backlash, FadingMemory, Grid, Loops, Lowpass, Operator, Poles, PrandtlIshlinskii, Span, Start,
    Times,
};
use stretch_receptor::{
    Defects, DiagnosedReceptor, Receptor, Withheld, example_diagnosed, example_observer,
};
use testkit::{random::noise, tolerance::F64_ROUNDING};

const DT_S: f64 = 0.01;
const SLIP: Plays = Plays { share: 1.0, radii: [0.014, 0.02, 0.026] };
const LOOPS: Plays = Plays { share: 0.2, radii: [0.05, 0.1, 0.2] };
const OVERSHOOT: Fading = Fading { share: 0.3, taus_s: [0.2, 0.4, 0.8] };

fn plain() -> DiagnosedMap {
    let Model::Diagnosed(map) = example_diagnosed().spec().model else { unreachable!() };
    DiagnosedMap {
        slip: None,
        relaxation: None,
        initial_hysteresis: [-1.0, 1.0],
        noise: 0.002,
        ..map
    }
}

fn calibration(map: DiagnosedMap) -> Calibration {
    let spec = example_diagnosed().into_spec();
    Calibration::new(stretch_core::CalibrationSpec { model: Model::Diagnosed(map), ..spec })
        .expect("a map that holds together")
}

/// Returns a motion that starts at rest, has several speeds and contains rests and reversals.
fn motion() -> Vec<f64> {
    let sum = |t: f64| 0.4 - 0.25 * (1.1 * t).cos() - 0.15 * (2.7 * t).cos();
    // forwards, a rest, and back the same way
    let one = |i: usize| match i % 3000 {
        n if n < 1100 => sum(0.01 * n as f64),
        n if n < 1500 => sum(11.0),
        n if n < 2600 => sum(0.01 * (2600 - n) as f64),
        _ => sum(0.0),
    };
    (0..4500).map(one).collect()
}

/// Returns the result of the effects' operators for a motion.
fn by_operators(map: &DiagnosedMap, motion: &[f64]) -> Vec<f64> {
    let grid = Grid::samples(DT_S).unwrap();
    let span = Span::whole(&grid);
    let mut signal = motion.to_vec();
    let mut run = |operator: &dyn Operator| {
        let mut cells = vec![0.0; operator.cells()];
        operator.begin(Start::Settled, signal[0], &mut cells);
        operator.run(&span, &mut cells, &mut signal);
    };
    if let Some(slip) = map.slip {
        run(&Backlash::soft(slip.radii[1], 1.0 - slip.radii[0] / slip.radii[1]));
    }
    if let Some(loops) = map.hysteresis {
        let [_, b, s] = loops.radii;
        run(&PrandtlIshlinskii::new(Loops { h: loops.share, s, spread: b / s }));
    }
    if let Some(fading) = map.relaxation {
        let times = Times { tau_s: fading.taus_s[1], spread: fading.taus_s[2] / fading.taus_s[1] };
        run(&FadingMemory::new(fading.share, times, 1.0, &grid));
    }
    if let Some([first, second]) = map.lowpass_s {
        let tau_s = first + second;
        run(&Lowpass::new(Poles { tau_s, second: second / tau_s }, &grid));
    }
    signal
}

#[test]
fn forwards_it_is_the_operators() {
    let map = DiagnosedMap {
        slip: Some(SLIP),
        hysteresis: Some(LOOPS),
        relaxation: Some(OVERSHOOT),
        lowpass_s: Some([0.03, 0.005]),
        initial_hysteresis: [0.0, 0.0],
        ..plain()
    };
    let defects = Defects::<f64>::new(&map, DT_S);
    let motion = motion();
    let mut memory = defects.begin(motion[0], 0.0);
    // The first sample settles; operators emit it without advancing time.
    for (y, expected) in motion.iter().zip(by_operators(&map, &motion)).skip(1) {
        let found = defects.advance(&mut memory, *y, 0.0);
        assert_relative_eq!(found, expected, epsilon = 1e-12, max_relative = 100.0 * F64_ROUNDING);
    }
}

/// Returns the root mean square of the error in target, and of the error in multiples of the reading's standard
/// deviation.
fn inverted(map: DiagnosedMap, pressure: impl Fn(f64) -> f64) -> (f64, f64) {
    let calibration = calibration(map);
    let receptor = DiagnosedReceptor::<f64>::new(&calibration).unwrap();
    let defects = Defects::<f64>::new(&map, DT_S);
    let motion = motion();
    let mut now = defects.begin(motion[0], pressure(motion[0]));
    let drives: Vec<f64> =
        motion.iter().map(|&y| defects.advance(&mut now, y, pressure(y))).collect();
    let late = (map.skew_s / DT_S).round() as isize;
    let knots = map.curve.len() - 1;
    let curve = |drive: f64| {
        let span = map.drive_domain.max - map.drive_domain.min;
        let place = ((drive - map.drive_domain.min) / span * knots as f64).clamp(0.0, knots as f64);
        let below = (place as usize).min(knots - 1);
        map.curve[below] + (place - below as f64) * (map.curve[below + 1] - map.curve[below])
    };
    let mut memory = receptor.memory();
    let (mut squares, mut apart, mut count) = (0.0, 0.0, 0.0);
    for (i, y) in motion.iter().enumerate() {
        let shown = (i as isize - late).clamp(0, drives.len() as isize - 1) as usize;
        memory.set_pressure(pressure(motion[shown]));
        let volts = curve(drives[shown]) + map.noise * noise(i);
        let reading = receptor.step(&mut memory, Volts(volts)).unwrap();
        // a muscle of 180 mm with a stroke of 0.165 of this length
        let found = (180.0 - reading.estimate) / (180.0 * 0.165);
        let sd = reading.sd.unwrap() / (180.0 * 0.165);
        if i > 20 {
            squares += (found - y).powi(2);
            apart += ((found - y) / sd).powi(2);
            count += 1.0;
        }
    }
    ((squares / count).sqrt(), (apart / count).sqrt())
}

/// With this noise, the estimate of a gauge without defects has an error of 0.002 of the stroke. Defects that hide no
/// motion are inverted about as well. A play or a delay adds an error of about the motion that it hides: after a
/// reversal, a slip of 0.02 causes an error until the filter detects the reversal of the sleeve, and a skew must be
/// bridged by prediction. The filter's standard deviation does not include errors in the states of its defects. A fit
/// corrects this with a measured factor ([`DiagnosedMap::spread`]), which is 1 here.
#[test]
fn every_defect_is_inverted() {
    let knee = |at| Some(Knee { at, width: 0.01 });
    let worn = Worn { m: 0.1, n: 3.0, zero: 0.0, reversal: 0.0025, travelled: 0.0 };
    let crosstalk = Some(Crosstalk { c: 0.1, bend: 0.3, scale: 600.0 });
    let base = plain();
    let cases = [
        ("nothing", base, 0.003),
        ("relaxation", DiagnosedMap { relaxation: Some(OVERSHOOT), ..base }, 0.005),
        ("hysteresis", DiagnosedMap { hysteresis: Some(LOOPS), ..base }, 0.003),
        ("worn", DiagnosedMap { worn: Some(worn), ..base }, 0.004),
        ("crosstalk", DiagnosedMap { crosstalk, ..base }, 0.003),
        ("lowpass", DiagnosedMap { lowpass_s: Some([0.03, 0.003]), ..base }, 0.009),
        ("skew", DiagnosedMap { skew_s: 0.05, ..base }, 0.012),
        ("early", DiagnosedMap { skew_s: -0.03, ..base }, 0.005),
        ("slip", DiagnosedMap { slip: Some(SLIP), ..base }, 0.012),
        ("slack", DiagnosedMap { slack_high: knee(0.75), ..base }, 0.016),
        ("clipped", DiagnosedMap { floor: knee(0.1), ..base }, 0.013),
        (
            "three",
            DiagnosedMap {
                slip: Some(SLIP),
                hysteresis: Some(LOOPS),
                relaxation: Some(OVERSHOOT),
                ..base
            },
            0.012,
        ),
    ];
    let mut wrong = Vec::new();
    for (name, map, most) in cases {
        let (rmse, apart) = inverted(map, |y| 500.0 * y);
        println!("{name}: {rmse:.4} of the stroke, {apart:.2} standard deviations");
        if rmse > most || apart > 4.5 {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn it_says_where_it_does_not_know() {
    let slack = DiagnosedMap { slack_high: Some(Knee { at: 0.6, width: 0.005 }), ..plain() };
    let receptor = DiagnosedReceptor::<f64>::new(&calibration(slack)).unwrap();
    let defects = Defects::<f64>::new(&slack, DT_S);
    let mut memory = receptor.memory();
    let mut now = defects.begin(0.0, 0.0);
    let mut sd = |from: f64, to: f64| {
        let mut last = 0.0;
        for i in 0..200 {
            let y = from + (to - from) * f64::from(i) / 200.0;
            let drive = defects.advance(&mut now, y, 0.0);
            let place = (drive - slack.drive_domain.min)
                / (slack.drive_domain.max - slack.drive_domain.min);
            let volts = 1.24 + place * (1.64 - 0.82 * place);
            last = receptor.step(&mut memory, Volts(volts)).unwrap().sd.unwrap();
        }
        last
    };
    let taut = sd(0.0, 0.5);
    let slack = sd(0.5, 0.95);
    assert!(slack > 1.5 * taut, "{slack} {taut}");
}

#[test]
fn lost_samples_are_predicted_over_and_wrong_models_refused() {
    let receptor = Receptor::<f64>::new(&example_diagnosed()).unwrap();
    let mut memory = receptor.memory();
    let volts = |i: i32| Volts(1.3 + 0.004 * f64::from(i));
    for i in 0..100 {
        receptor.step(&mut memory, volts(i)).unwrap();
    }
    assert_eq!(receptor.step(&mut memory, Volts(f64::NAN)), Err(Withheld::Missing));
    let mut other = memory;
    let bridged = receptor.step(&mut memory, volts(101)).unwrap().estimate;
    let unbroken = {
        let mut memory = receptor.memory();
        (0..102).map(|i| receptor.step(&mut memory, volts(i)).unwrap().estimate).last().unwrap()
    };
    assert!((bridged - unbroken).abs() < 0.1, "{bridged} {unbroken}");
    for _ in 0..10 {
        let _ = receptor.step(&mut other, Volts(f64::NAN));
    }
    // in a long gap the variance grows, and the next sample determines the estimate almost alone
    assert!(receptor.step(&mut other, Volts(1.4)).unwrap().rate.abs() < 1e3);
    let refused = DiagnosedReceptor::<f32>::new(&example_observer()).unwrap_err();
    assert!(refused.to_string().contains("diagnosed"), "{refused}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// For any stream and any pressure, rate and standard deviation are finite, and the estimate stays within the
    /// fitted targets and 2 % more.
    #[test]
    fn no_stream_makes_it_leave_its_domain(
        calibration in stretch_strategies::diagnosed_calibration(),
        stream in stretch_strategies::faulty_voltages(150),
        pressure in proptest::num::f64::ANY,
    ) {
        let Model::Diagnosed(map) = &calibration.spec().model else { unreachable!() };
        let receptor = DiagnosedReceptor::<f64>::new(&calibration).unwrap();
        let (range, target) = (calibration.spec().target_range, calibration.spec().target);
        let mut memory = receptor.memory();
        memory.set_pressure(pressure);
        for volts in stream {
            let Ok(reading) = receptor.step(&mut memory, Volts(volts)) else { continue };
            prop_assert!(reading.rate.is_finite() && reading.sd.unwrap().is_finite());
            let y = range.normalise(target.from_reference(reading.estimate));
            let edge = 0.0201 * (map.estimate_domain.max - map.estimate_domain.min);
            prop_assert!(
                (map.estimate_domain.min - edge..=map.estimate_domain.max + edge).contains(&y),
                "{y}"
            );
        }
    }
}
