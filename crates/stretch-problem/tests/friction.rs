//! Friction is looked for if a force or a torque drives a motion, whatever usual name its column has. If it is unknown
//! whether a force or a torque drives the motion, a note states it.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::{Candidate, Options, RandomGenerator, diagnose};
use stretch_problem::{
    Ask, BlackBox, Checked, Input, Parameter, ProblemSpec, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 1500;

/// A pendulum with a drag and a weight of 20 Nm, and dry friction `dry` in its joint.
fn pendulum(drag: f64, dry: f64, torque: &[f64]) -> Vec<f64> {
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let step = |u: &f64| {
        let shown = x;
        for _ in 0..20 {
            let push = u - drag * v - 20.0 * x.sin();
            let rubs = dry * (v / 1e-3).tanh();
            let next = v + DT_S / 20.0 * (push - rubs);
            // the joint sticks if friction would reverse the motion
            v = if dry > 0.0 && v * next <= 0.0 && push.abs() < dry { 0.0 } else { next };
            x += DT_S / 20.0 * v;
        }
        shown
    };
    torque.iter().map(step).collect()
}

fn torque() -> Vec<f64> {
    let at = |i: usize| {
        let t = DT_S * i as f64;
        9.0 * (1.32 * t + 1.0).sin() + 4.0 * (3.33 * t + 0.3).sin()
    };
    (0..SAMPLES).map(at).collect()
}

fn spec([input, output]: [&str; 2]) -> ProblemSpec {
    let mut random = RandomGenerator::new(3, 0);
    let torque = torque();
    let angle = pendulum(0.4, 1.2, &torque).iter().map(|x| x + 5e-4 * random.gauss()).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    ProblemSpec {
        stages: vec![StageEntry {
            name: "joint".into(),
            output: output.into(),
            inputs: vec![input.into()],
            noise: Some(5e-4),
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "drag".into(),
            value: 0.4,
            tolerance: Tolerance::Relative(0.2),
            ..Parameter::default()
        }],
        wrap: vec!["all".into()],
        trials: vec![SessionTrial::new(Trial {
            name: "a.csv".into(),
            time_s: (0..SAMPLES).map(|i| DT_S * i as f64).collect(),
            channels: vec![channel(input, torque), channel(output, angle)],
        })],
        ..ProblemSpec::default()
    }
}

fn frictions(problem: &Checked) -> Vec<String> {
    let names = problem.description().spec().effects.iter().map(|effect| effect.name.clone());
    names.filter(|name| name.ends_with("_friction")).collect()
}

fn notes(problem: &Checked) -> Vec<&str> {
    let all = problem.notes().iter().map(String::as_str);
    all.filter(|note| note.starts_with("friction is not")).collect()
}

#[test]
fn each_spelling_of_a_force_or_torque_rubs_alike() {
    let all = ["coulomb", "stribeck", "dahl", "play"];
    let all = all.map(|kind| format!("input.{kind}_friction"));
    let mut named = spec(["torque_nm", "angle_rad"]);
    named.stages[0].position = Some("angle_rad".into());
    let named = frictions(&Checked::new(named).expect("a problem"));
    assert_eq!(named.len(), all.len() + 1, "{named:?}");
    assert!(named.contains(&"input.viscous_friction".to_owned()), "{named:?}");
    for input in [
        "torque_nm",
        "torque_Nm",
        "torque_NM",
        "torque_n_m",
        "drive_nm",
        "load_N_m",
        "tau",
        "tau_1",
        "force_n",
        "force_N",
        "force_kN",
        "force_N_m",
        "u_n",
    ] {
        for output in ["angle_rad", "q", "knee_deg", "length_mm", "position", "speed_rad_per_s"] {
            let problem = Checked::new(spec([input, output])).expect("a problem");
            assert_eq!(frictions(&problem), all, "{input}, {output}");
            assert!(notes(&problem).is_empty(), "{:?}", problem.notes());
            let viscous = |note: &String| note.starts_with("viscous friction is not looked for");
            assert!(problem.notes().iter().any(viscous), "{:?}", problem.notes());
        }
    }
    let stated = |unit: &str| {
        let input = Input { column: "u".into(), unit: unit.into(), noise: 0.0 };
        let spec = ProblemSpec { inputs: vec![input], ..spec(["u", "angle_rad"]) };
        frictions(&Checked::new(spec).expect("a problem"))
    };
    for unit in ["Nm", "N m", "N·m", "mNm", "N", "newton"] {
        assert_eq!(stated(unit), all, "{unit}");
    }
    assert!(stated("V").is_empty());
}

#[test]
fn a_note_says_where_friction_is_not_looked_for() {
    for (columns, says) in [
        (["torque_nm", "level"], "at torque_nm: name velocity or position in stage joint"),
        (["u", "angle_rad"], "at u: its unit does not show that it is a force or a torque"),
        (["command_V", "angle_rad"], ""),
        (["command_deg", "angle_deg"], ""),
        (["u", "level_V"], ""),
    ] {
        let problem = Checked::new(spec(columns)).expect("a problem");
        let notes = notes(&problem);
        assert!(frictions(&problem).is_empty(), "{columns:?}");
        assert_eq!(notes.len(), usize::from(!says.is_empty()), "{columns:?}: {notes:?}");
        // the words hold for a problem.toml and for the arguments in Python
        let holds = |note: &&str| note.contains(says) && !note.contains("[[");
        assert!(notes.iter().all(holds), "{notes:?}");
    }
    // a stage that names its position is expected to have friction
    let mut named = spec(["command_V", "angle_rad"]);
    named.stages[0].position = Some("angle_rad".into());
    let notes = Checked::new(named).expect("a problem").notes().join("; ");
    assert!(
        notes.contains("friction is not looked for at command_V: its unit does not show"),
        "{notes}"
    );
}

#[test]
fn dry_friction_is_found_without_a_position() {
    let mut spec = spec(["torque_nm", "angle_rad"]);
    spec.wrap = ["input.friction", "input.delay", "output.lag"].map(str::to_owned).to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let torque = torque();
        let torque = ask.inputs.map_or(&torque[..], |inputs| &inputs[0]);
        Ok(pendulum(ask.parameters[0], 0.0, torque))
    });
    let bench = BlackBox::new(Checked::new(spec).expect("a problem"), Arc::new(source));
    let found = diagnose(&bench, &Options::default(), &|_| (), &|| false).expect("a diagnosis").0;
    let is_dry = |c: &&Candidate| c.effects == ["input.coulomb_friction"];
    let dry = found.candidates.iter().find(is_dry).expect("dry friction");
    assert!(dry.probability > 0.5, "{}", found.sentence);
    assert!((dry.by_name["f"] - 1.2).abs() < 0.1, "{:?}", dry.by_name);
}
