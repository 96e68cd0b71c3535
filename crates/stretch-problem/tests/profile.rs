//! A servo whose firmware follows each command by a trapezoidal profile. The limits are found at
//! their values, and the gains stay as shipped.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 1500;
const NOISE: f64 = 0.001;
const STEPS: usize = 5;

/// The servo, without a profile.
fn servo([kp, kd]: [f64; 2], command: &[f64]) -> Vec<f64> {
    let (mut x, mut v) = (0.0, 0.0);
    let h = DT_S / STEPS as f64;
    let step = |u: &f64| {
        let shown = x;
        for _ in 0..STEPS {
            v += h * (kp * (u - x) - kd * v);
            x += h * v;
        }
        shown
    };
    command.iter().map(step).collect()
}

/// The machine: a profile with limits of acceleration and rate in front of the servo.
fn machine([kp, kd]: [f64; 2], [a, rate]: [f64; 2], command: &[f64]) -> Vec<f64> {
    let (mut x, mut v, mut p, mut w) = (0.0, 0.0, 0.0, 0.0_f64);
    let h = DT_S / STEPS as f64;
    let step = |u: &f64| {
        let shown = x;
        for _ in 0..STEPS {
            let apart: f64 = u - p;
            let wanted = f64::min(rate, (2.0 * a * apart.abs()).sqrt()).copysign(apart);
            w += (wanted - w).clamp(-a * h, a * h);
            p += w * h;
            if (u - p).abs() < 1e-4 && w.abs() < 2.0 * a * h {
                (p, w) = (*u, 0.0);
            }
            v += h * (kp * (p - x) - kd * v);
            x += h * v;
        }
        shown
    };
    command.iter().map(step).collect()
}

fn commands(trial: u64) -> Vec<f64> {
    let mut random = RandomGenerator::new(21, trial);
    let (mut u, mut left) = (0.0, 60_usize);
    let step = |_| {
        if left == 0 {
            u = 2.4 * random.unit() - 1.2;
            left = 80 + (120.0 * random.unit()) as usize;
        }
        left -= 1;
        u
    };
    (0..SAMPLES).map(step).collect()
}

#[test]
fn the_limits_of_a_profile_are_found_beside_gains_of_any_tolerance() {
    for (gains, limits, share) in
        [([500.0, 40.0], [8.0, 1.2], 0.1), ([500.0, 40.0], [5.0, 1.8], 0.2)]
    {
        let mut random = RandomGenerator::new(4, 0);
        let mut trial = |trial: u64| {
            let u = commands(trial);
            let y = machine(gains, limits, &u);
            let y = y.iter().map(|y| y + NOISE * random.gauss()).collect();
            let channel = |name: &str, values| Channel { name: name.into(), values };
            let time_s = (0..SAMPLES).map(|i| DT_S * i as f64).collect();
            let channels = vec![channel("command_rad", u), channel("angle_rad", y)];
            let split = if trial == 1 { Split::Test } else { Split::Fit };
            let own = Trial { name: format!("{trial}.csv"), time_s, channels };
            SessionTrial { split, start_s: 30.0 * trial as f64, ..SessionTrial::new(own) }
        };
        let parameter = |name: &str, value| Parameter {
            name: name.into(),
            value,
            tolerance: Tolerance::Relative(share),
            ..Parameter::default()
        };
        let problem = Checked::new(ProblemSpec {
            stages: vec![StageEntry {
                name: "servo".into(),
                output: "angle_rad".into(),
                inputs: vec!["command_rad".into()],
                noise: Some(NOISE),
                ..StageEntry::default()
            }],
            parameters: vec![parameter("kp", gains[0]), parameter("kd", gains[1])],
            wrap: ["input.profile", "input.slew_limit", "input.lag", "output.lag"]
                .map(str::to_owned)
                .to_vec(),
            trials: vec![trial(0), trial(1)],
            ..ProblemSpec::default()
        });
        let problem = problem.expect("a problem");
        let recorded = problem.session().column("command_rad").expect("it is used").to_vec();
        let source = closure(move |ask: &Ask<'_>| {
            let u = ask.inputs.map_or(&recorded[..ask.trials * SAMPLES], |inputs| &inputs[0]);
            let own = [ask.parameters[0], ask.parameters[1]];
            Ok(u.chunks(SAMPLES).flat_map(|u| servo(own, u)).collect())
        });
        let bench = BlackBox::new(problem, Arc::new(source));
        let told = diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("told").0;
        let values = &told.candidates[0].parameters;
        let case = format!("{} runs {}: {values:?}", told.sentence, bench.model_runs());
        assert_eq!(told.named(), ["input.profile"], "{case}");
        for (value, truth) in values.iter().zip(limits) {
            assert!((value.value / truth - 1.0).abs() < 0.05, "{truth} {case}");
        }
        assert!(told.parameters.iter().all(|p| p.sigmas.abs() < 0.5), "{case}");
        // A small gap is left, because the machine's profile changes within a sample.
        assert!(told.gap.left < 0.02 * told.gap.retuned, "{:?} {case}", told.gap);
    }
}
