//! A simulator with other units than the recording is reported as such.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::{Diagnosis, Options, RandomGenerator, VerdictKind, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

/// Diagnoses a first-order lag that is recorded in `unit`, with 1 % of noise. The simulator's
/// output is `ratio` times as large, and its parameters have these tolerances.
fn told(unit: &str, ratio: f64, tolerances: [f64; 2]) -> Diagnosis {
    const DT_S: f64 = 0.01;
    let lag = |gain: f64, tau: f64, u: &[f64]| -> Vec<f64> {
        let kept = (-DT_S / tau).exp();
        let mut y = gain * u[0];
        let mut next = |u: &f64| {
            y = gain * u + kept * (y - gain * u);
            y
        };
        u.iter().map(&mut next).collect()
    };
    // Parameters without a tolerance have their true values.
    let true_value = |nominal: f64, other, tolerance| if tolerance > 0.0 { other } else { nominal };
    let (true_gain, true_tau) =
        (true_value(0.5, 0.51, tolerances[0]), true_value(0.1, 0.11, tolerances[1]));
    let mut random = RandomGenerator::new(7, 0);
    let time_s: Vec<f64> = (0..4000).map(|i| DT_S * f64::from(i)).collect();
    let command: Vec<f64> =
        time_s.iter().map(|t| 4.0 * (1.3 * t).sin() + (4.1 * t).cos()).collect();
    let noisy = |y: f64| y + 0.02 * random.gauss();
    let output = lag(true_gain, true_tau, &command).into_iter().map(noisy).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("command_V", command.clone()), channel("output", output)];
    let parameter = |name: &str, value, share| Parameter {
        name: name.into(),
        value,
        tolerance: Tolerance::Relative(share),
        least: Some(1e-3),
        ..Parameter::default()
    };
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "motor".into(),
            output: "output".into(),
            unit: unit.into(),
            inputs: vec!["command_V".into()],
            noise: Some(0.02),
            ..StageEntry::default()
        }],
        parameters: vec![
            parameter("gain", 0.5, tolerances[0]),
            parameter("tau", 0.1, tolerances[1]),
        ],
        wrap: vec!["all".into()],
        trials: vec![SessionTrial::new(Trial { name: "a.csv".into(), time_s, channels })],
        ..ProblemSpec::default()
    });
    let source = closure(move |ask: &Ask<'_>| {
        let u = ask.inputs.map_or(command.as_slice(), |inputs| &inputs[0]);
        let y = lag(ask.parameters[0], ask.parameters[1], u);
        Ok(y.into_iter().map(|y| ratio * y).collect())
    });
    let bench = BlackBox::new(problem.expect("a problem"), Arc::new(source));
    diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0
}

#[test]
fn other_units_are_told_by_their_names() {
    let degrees = 180.0 / std::f64::consts::PI;
    for (unit, ratio, units) in [
        ("rad/s", degrees / 6.0, "rpm for rad/s"),
        ("rad", degrees, "deg for rad"),
        ("deg", 1.0 / degrees, "rad for deg"),
        ("m", 1e3, "mm for m"),
        ("mV", 1e-3, "V for mV"),
    ] {
        let told = told(unit, ratio, [0.03, 0.1]);
        assert_eq!(told.verdict(), VerdictKind::Record, "{units}: {}", told.sentence);
        assert_eq!(told.answer.gross()[0].units.as_deref(), Some(units), "{}", told.sentence);
        let begins = "Simulation and recording differ by a factor: the simulated output is ";
        assert!(told.sentence.starts_with(begins), "{}", told.sentence);
        // the parameters have tolerances already
        assert!(!told.sentence.contains("tolerances"), "{}", told.sentence);
    }
}

/// If no parameter may change, a factor cannot be attributed to the sensor rather than the
/// simulator.
#[test]
fn a_factor_beside_parameters_without_tolerance_is_told_as_a_factor() {
    for (ratio, says) in [(0.8, "0.8"), (1.25, "1.25")] {
        let told = told("rad/s", ratio, [0.0, 0.0]);
        assert_eq!(told.verdict(), VerdictKind::Record, "{}", told.sentence);
        let begins =
            format!("Simulation and recording differ by a factor: the simulated output is {says}");
        assert!(told.sentence.starts_with(&begins[..begins.len() - 1]), "{}", told.sentence);
        assert!(told.sentence.contains("tolerances"), "{}", told.sentence);
    }
}
