//! Ranges for domain randomisation: the truth lies in the 90 % region of nine in ten simulated
//! servos. Parameters of the servos are drawn from their tolerances, and a third of the servos has a
//! late sensor, another third a brake.

use std::sync::Arc;

use statrs::distribution::{ChiSquared, ContinuousCDF};
use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_effects::{Grid, Skew, SkewSpec};
use stretch_gap::{Options, RandomGenerator};
use stretch_problem::{
    Argument, Ask, BlackBox, Checked, Examined, OwnEffect, Parameter, Problem, ProblemSpec,
    RangeSet, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.02;
const SAMPLES: usize = 1000;
const REGION: f64 = 0.9;
/// Standard deviations of the gain, the time constant and the zero.
const TOLERANCES: [f64; 3] = [1.0, 0.01, 1.0];
const NOMINAL: [f64; 3] = [10.0, 0.1, 0.0];

/// Steps and waves in turn.
fn command(trial: usize) -> Vec<f64> {
    let mut random = RandomGenerator::new(40 + trial as u64, 0);
    let mut held = 0.0;
    let at = |i: usize| {
        let t = i as f64 * DT_S;
        if i.is_multiple_of(65) {
            held = (4.0 * random.gauss()).clamp(-6.0, 6.0);
        }
        let wave = 3.0 * (1.1 * t).sin() + 2.0 * (2.9 * t + trial as f64).sin();
        if (i / 300).is_multiple_of(2) { held } else { wave }
    };
    (0..SAMPLES).map(at).collect()
}

/// The angle of a servo of first order. The brake reduces the distance from the commanded angle.
fn servo([gain, tau, zero]: [f64; 3], brake: f64, u: &[f64]) -> Vec<f64> {
    let decay = (-DT_S / tau).exp();
    let mut angle = 0.0;
    let step = |u: &f64| {
        let push = gain * u - angle;
        angle += (1.0 - decay) * (push - push.clamp(-brake, brake));
        zero + angle
    };
    u.iter().map(step).collect()
}

/// The true values of a servo: its parameters, a delay of its sensor (s) and a brake (deg).
struct Truth {
    parameters: [f64; 3],
    delay_s: f64,
    brake: f64,
}

impl Truth {
    fn drawn(seed: u64) -> Self {
        let mut random = RandomGenerator::new(seed, 0);
        let mut parameters = NOMINAL;
        parameters.iter_mut().zip(TOLERANCES).for_each(|(p, sd)| *p += sd * random.gauss());
        let size = 1.0 + random.gauss().abs();
        let [delay_s, brake] = match seed % 3 {
            0 => [0.0, 0.0],
            1 => [0.03 * size, 0.0],
            _ => [0.0, size],
        };
        Self { parameters, delay_s, brake }
    }

    fn of(&self, name: &str) -> f64 {
        match name {
            "gain" => self.parameters[0],
            "tau" => self.parameters[1],
            "zero" => self.parameters[2],
            "output.delay.delay_s" => self.delay_s,
            // The late sensor shows the first angle until the second one arrives.
            "output.delay.empty" => 0.0,
            "brake.brake" => self.brake,
            other => panic!("{other}"),
        }
    }

    /// The angle of a trial without noise.
    fn clean(&self, trial: usize) -> Vec<f64> {
        let angle = servo(self.parameters, self.brake, &command(trial));
        let late = SkewSpec { skew_s: self.delay_s, ..SkewSpec::default() };
        let mut shown = vec![0.0; SAMPLES];
        Skew::new(&Grid::samples(DT_S).unwrap(), late).sample(&angle, &mut shown);
        shown
    }

    fn recorded(&self, seed: u64) -> Vec<SessionTrial> {
        let one = |trial: usize| {
            let mut random = RandomGenerator::new(seed, 1 + trial as u64);
            let u = command(trial);
            let angle = self.clean(trial);
            let angle = angle.iter().map(|y| y + 0.3 * random.gauss()).collect();
            let channel = |name: &str, values| Channel { name: name.into(), values };
            let channels = vec![channel("command_V", u), channel("angle_deg", angle)];
            let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
            let split = if trial == 2 { Split::Test } else { Split::Fit };
            let recorded = Trial { name: format!("t{trial}.csv"), time_s, channels };
            SessionTrial { split, ..SessionTrial::new(recorded) }
        };
        (0..3).map(one).collect()
    }
}

fn examined(trials: Vec<SessionTrial>) -> Examined {
    let parameter = |i: usize, name: &str, unit: &str| Parameter {
        name: name.into(),
        unit: unit.into(),
        value: NOMINAL[i],
        tolerance: Tolerance::Absolute(TOLERANCES[i]),
        ..Parameter::default()
    };
    let brake =
        Argument { unit: "deg".into(), range: [0.0, 20.0], off: Some(0.0), ..Argument::default() };
    let spec = ProblemSpec {
        stages: vec![StageEntry {
            name: "servo".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_V".into()],
            ..StageEntry::default()
        }],
        parameters: vec![
            parameter(0, "gain", "deg/V"),
            parameter(1, "tau", "s"),
            parameter(2, "zero", "deg"),
        ],
        effects: vec![OwnEffect {
            name: "brake".into(),
            arguments: vec![brake],
            ..OwnEffect::default()
        }],
        wrap: vec!["output.delay".into(), "output.saturation".into()],
        trials,
        ..ProblemSpec::default()
    };
    let checked = Checked::new(spec).unwrap();
    let measured = checked.session().column("command_V").unwrap().to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let u = ask.inputs.map_or(&measured[..ask.trials * SAMPLES], |inputs| &inputs[0]);
        let p = std::array::from_fn(|i| ask.parameters[i]);
        Ok(u.chunks(SAMPLES).flat_map(|u| servo(p, ask.effects[0], u)).collect())
    });
    let problem = Problem::from(BlackBox::new(checked, Arc::new(source)));
    problem.examine(&Options::default(), false, &|_| (), &|| false).unwrap()
}

/// Squared distance of the truth from the fitted values, in the metric of the covariance: |z|^2
/// with L z = truth - value.
fn distance(set: &RangeSet, truth: &Truth) -> f64 {
    let mut z: Vec<f64> = Vec::new();
    for (p, row) in set.parameters.iter().zip(&set.factor) {
        let truth = truth.of(&p.name);
        let moved = if p.is_log { (truth / p.value).ln() } else { truth - p.value };
        let known: f64 = row.iter().zip(&z).map(|(l, z)| l * z).sum();
        z.push((moved - known) / row[z.len()]);
    }
    z.iter().map(|z| z * z).sum()
}

/// Whether the truth lies in the 90 % region of the most probable set.
fn is_covered(seed: u64) -> bool {
    let truth = Truth::drawn(seed);
    let examined = examined(truth.recorded(seed));
    let set = &examined.ranges.as_ref().expect("ranges").sets[0];
    let wanted: &[&str] = [&[][..], &["output.delay"], &["brake"]][seed as usize % 3];
    let freedom = set.parameters.len() as f64;
    let limit = ChiSquared::new(freedom).unwrap().inverse_cdf(REGION);
    set.effects == wanted && distance(set, &truth) <= limit
}

#[test]
fn ranges_are_joint_and_can_be_read_as_yaml() {
    let truth = Truth { parameters: [11.0, 0.12, 0.4], delay_s: 0.05, brake: 0.0 };
    let examined = examined(truth.recorded(1));
    let ranges = examined.ranges.as_ref().expect("ranges");
    let set = &ranges.sets[0];
    assert_eq!(set.effects, ["output.delay"]);
    let names: Vec<&str> = set.parameters.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["gain", "tau", "zero", "output.delay.delay_s", "output.delay.empty"]);
    // A longer delay looks like a longer time constant, so the two are drawn together.
    let [tau, delay] = [&set.factor[1], &set.factor[3]];
    let product: f64 = tau.iter().zip(delay).map(|(a, b)| a * b).sum();
    assert!(product / (set.parameters[1].sd * set.parameters[3].sd) < -0.5, "{product}");
    assert!(set.parameters.iter().all(|p| p.least <= p.value && p.value <= p.greatest));
    assert_eq!(examined.to_json()["ranges"], serde_json::to_value(ranges).unwrap());
    let text = ranges.to_text();
    let numbers = text.split([' ', ',', '\n']).filter(|word| word.parse::<f64>().is_ok());
    assert!(numbers.filter(|word| word.contains('e')).all(|word| word.contains('.')), "{text}");
    let read: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(read, serde_json::to_value(ranges).unwrap());
}

#[test]
fn the_truth_lies_in_the_region_of_most_servos() {
    let covered = (1..=12).filter(|seed| is_covered(*seed)).count();
    assert!(covered >= 9, "{covered} of 12");
}

#[test]
#[ignore = "200 diagnoses; ./ci.sh runs it"]
fn the_truth_lies_in_the_region_of_nine_in_ten_of_200_servos() {
    let covered = (1001..=1200).filter(|seed| is_covered(*seed)).count();
    println!("{covered} of 200");
    assert!((174..=186).contains(&covered), "{covered} of 200");
}
