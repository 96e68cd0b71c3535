//! A toy plant, a servo of first order, with recordings in which each wrapper was hidden in turn.

mod hidden;

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

use hidden::hidden;
use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{
    Description, Diagnosis, GapError, Knowledge, MissingEffect, NoteCode, Options, RandomGenerator,
    Run, Simulator, diagnose,
};
use stretch_problem::{
    Argument, Ask, BlackBox, Checked, OwnEffect, Parameter, ProblemSpec, StageEntry, Tolerance,
    closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 3000;

/// Command of a trial: steps and waves in turn.
fn command(trial: usize) -> Vec<f64> {
    let mut random = RandomGenerator::new(40 + trial as u64, 0);
    let (mut held, mut out) = (0.0, Vec::with_capacity(SAMPLES));
    for i in 0..SAMPLES {
        let t = i as f64 * DT_S;
        if i % 130 == 0 {
            held = (4.0 * random.gauss()).clamp(-6.0, 6.0);
        }
        let wave = 3.0 * (1.1 * t).sin() + 2.0 * (2.9 * t + trial as f64).sin();
        out.push(if (i / 600) % 2 == 0 { held } else { wave });
    }
    out
}

/// Angle of the servo: angle' = (gain u - angle)/tau, exact for a held command. The brake reduces
/// the distance gain u - angle by up to `brake`.
fn servo(gain: f64, tau: f64, brake: f64, u: &[f64]) -> Vec<f64> {
    let decay = (-DT_S / tau).exp();
    let mut angle = 0.0;
    u.iter()
        .map(|u| {
            let before = angle;
            let push = gain * u - angle;
            let held = push - push.clamp(-brake, brake);
            angle += (1.0 - decay) * held;
            before
        })
        .collect()
}

fn servo_of(ask: &Ask<'_>, measured: &[f64]) -> Vec<f64> {
    let u = ask.inputs.map_or(&measured[..ask.trials * SAMPLES], |inputs| &inputs[0]);
    let [gain, tau, offset, bias, sides] = std::array::from_fn(|i| ask.parameters[i]);
    let of = |u: &f64| (u + bias) * (1.0 + sides * u.signum());
    let trials = u.chunks(SAMPLES).map(|u| u.iter().map(of).collect::<Vec<f64>>());
    let angles = trials.flat_map(|u| servo(gain, tau, ask.effects[0], &u));
    angles.map(|y| offset + y).collect()
}

/// Trials of a plant, which returns the angle for a command and the trial's start time.
fn recorded(plant: impl Fn(&[f64], f64) -> Vec<f64>) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let (u, start_s) = (command(trial), 60.0 * trial as f64);
        let mut random = RandomGenerator::new(7, trial as u64);
        let angle = plant(&u, start_s).iter().map(|y| y + 0.02 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("command_V", u), channel("angle_deg", angle)];
        let time_s = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let trial = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if start_s > 100.0 { Split::Test } else { Split::Fit };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    (0..3).map(one).collect()
}

fn parameter(name: &str, unit: &str, value: f64, tolerance: Tolerance) -> Parameter {
    Parameter { name: name.into(), unit: unit.into(), value, tolerance, ..Parameter::default() }
}

fn problem(trials: Vec<SessionTrial>, wrap: &[&str]) -> ProblemSpec {
    ProblemSpec {
        stages: vec![StageEntry {
            name: "servo".into(),
            output: "angle_deg".into(),
            inputs: vec!["command_V".into()],
            ..StageEntry::default()
        }],
        parameters: vec![
            parameter("gain", "deg/V", 10.0, Tolerance::Relative(0.1)),
            parameter("tau", "s", 0.1, Tolerance::Relative(0.1)),
            parameter("zero", "deg", 0.0, Tolerance::Absolute(1.0)),
            parameter("bias", "V", 0.0, Tolerance::Absolute(0.05)),
            parameter("sides", "1", 0.0, Tolerance::Absolute(0.01)),
        ],
        effects: vec![OwnEffect {
            name: "brake".into(),
            arguments: vec![Argument {
                unit: "deg".into(),
                range: [0.0, 20.0],
                off: Some(0.0),
                ..Argument::default()
            }],
            ..OwnEffect::default()
        }],
        wrap: wrap.iter().map(|w| (*w).to_owned()).collect(),
        trials,
        ..ProblemSpec::default()
    }
}

/// Diagnoses; also returns how often the servo was run.
fn diagnosed(spec: ProblemSpec, budget: Option<usize>) -> (Diagnosis, usize) {
    let problem = Checked::new(spec).unwrap();
    let measured = problem.session().column("command_V").unwrap().to_vec();
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&calls);
    let source = closure(move |ask: &Ask<'_>| {
        counted.fetch_add(1, Ordering::Relaxed);
        Ok(servo_of(ask, &measured))
    });
    let bench = BlackBox::within(problem, Arc::new(source), budget);
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let calls = calls.load(Ordering::Relaxed);
    assert_eq!(bench.model_runs(), calls, "every run is counted, and counted once");
    (diagnosis, calls)
}

/// The true servo, with a brake.
fn plain(u: &[f64], brake: f64) -> Vec<f64> {
    servo(10.4, 0.095, brake, u).into_iter().map(|y| 0.2 + y).collect()
}

const MANY: [&str; 8] = [
    "input.delay",
    "input.dead_zone",
    "input.saturation",
    "output.lag",
    "output.backlash",
    "output.hysteresis",
    "output.curve",
    "output.saturation",
];

/// Effects of a servo's drive and of its recorder, none of which may be named for a servo without
/// them.
const DRIVE: [&str; 4] =
    ["input.profile", "input.firmware_dead_band", "output.flexible_joint", "output.clock_drift"];

#[test]
fn a_servo_alone_has_no_joint_no_profile_and_no_drifting_clock() {
    let wrap: Vec<&str> = MANY.into_iter().chain(DRIVE).collect();
    let (diagnosis, _) = diagnosed(problem(recorded(|u, _| plain(u, 0.0)), &wrap), None);
    assert!(diagnosis.named().is_empty(), "{:?}: {}", diagnosis.named(), diagnosis.sentence);
}

/// Crosstalk from the only input of a stage to its output is examined only if it is requested by
/// name.
#[test]
fn all_has_no_crosstalk_from_the_only_input() {
    let has_crosstalk = |wrap: &str| {
        let checked = Checked::new(problem(recorded(|u, _| plain(u, 0.0)), &[wrap])).unwrap();
        let source = closure(|_: &Ask<'_>| Ok(Vec::new()));
        let bench = BlackBox::new(checked, Arc::new(source));
        bench.description().spec().effects.iter().any(|e| e.name == "output.crosstalk(command_V)")
    };
    assert!(!has_crosstalk("all") && has_crosstalk("output.crosstalk"));
}

#[test]
#[ignore = "a diagnosis of each of 27 effects; ./ci.sh runs it"]
fn each_hidden_effect_is_named_within_four_hundred_runs() {
    let (mut wrong, mut most) = (Vec::new(), 0);
    let only = std::env::var("STRETCH_ONLY").unwrap_or_default();
    for (name, plant) in hidden().into_iter().filter(|(name, _)| name.contains(&only)) {
        let mut wrap = MANY.to_vec();
        if name != "brake" && !wrap.contains(&name) {
            wrap.push(name);
        }
        let (diagnosis, runs) = diagnosed(problem(recorded(plant), &wrap), Some(400));
        println!(
            "{name}: {:?} {runs} runs of {} simulations, {}",
            diagnosis.named(),
            diagnosis.simulations,
            diagnosis.sentence
        );
        // A brake that holds some degrees of the push has the same effect on the angle as a play of
        // the command, so that either may rank first.
        let is_same = name == "input.backlash" && diagnosis.named() == ["brake"];
        let is_family = is_same
            || diagnosis.named().iter().any(|n| n == name)
            || diagnosis.ambiguous.iter().any(|n| n == name);
        most = most.max(runs);
        if !is_family || runs > 400 {
            wrong.push(format!("{name}: {:?} in {runs} runs", diagnosis.named()));
        }
    }
    println!("at most {most} model runs");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// For any budget, the search stops early enough that the runs of the answer can still be made and
/// the result of the search is kept.
#[test]
fn no_budget_loses_what_was_found() {
    for budget in [250, 300, 350, 500, 800, 1000] {
        let (_, plant) = hidden().into_iter().rfind(|(name, _)| *name == "input.profile").unwrap();
        let wrap: Vec<&str> = MANY.into_iter().chain(["input.profile"]).collect();
        let (diagnosis, runs) = diagnosed(problem(recorded(plant), &wrap), Some(budget));
        assert_eq!(diagnosis.named(), ["input.profile"], "{budget}: {}", diagnosis.sentence);
        assert!(runs <= budget, "{runs} of {budget}");
    }
}

/// A black box of which the engine uses only the basic methods, so that every simulation is a run,
/// as for any simulator.
struct Plain<'a>(&'a BlackBox);

impl Simulator for Plain<'_> {
    fn description(&self) -> &Description {
        self.0.description()
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.0.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        self.0.simulate(Run { near: None, ..run }, out)
    }
}

#[test]
#[ignore = "six whole diagnoses; ./ci.sh runs it"]
fn a_black_box_is_run_less_than_half_as_often_as_it_is_simulated() {
    for name in ["brake", "output.lag", "input.delay"] {
        let plant = hidden().into_iter().find(|(n, _)| *n == name).unwrap().1;
        let spec = problem(recorded(plant), &MANY);
        let (_, runs) = diagnosed(spec.clone(), None);
        let problem = Checked::new(spec).unwrap();
        let measured = problem.session().column("command_V").unwrap().to_vec();
        let source = closure(move |ask: &Ask<'_>| Ok(servo_of(ask, &measured)));
        let bench = BlackBox::new(problem, Arc::new(source));
        let plain = Plain(&bench);
        let (before, _) = diagnose(&plain, &Options::default(), &|_| (), &|| false).unwrap();
        println!(
            "{name}: {runs} runs, {} simulations of any simulator, {} kept",
            before.simulations,
            bench.model_runs()
        );
        assert_eq!(before.named(), [name]);
        assert!(2 * runs < before.simulations, "{name}: {runs} of {}", before.simulations);
    }
}

/// A mass on a rail with friction. The output is the force, which follows from the recorded motion
/// (the inverse form).
fn rail(trials: usize) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(90, trial as u64);
        let at = |t: f64| {
            let phase = trial as f64;
            [
                0.10 * (1.7 * t + phase).sin() + 0.05 * (4.3 * t).sin(),
                0.17 * (1.7 * t + phase).cos() + 0.215 * (4.3 * t).cos(),
                -0.289 * (1.7 * t + phase).sin() - 0.9245 * (4.3 * t).sin(),
            ]
        };
        let time_s: Vec<f64> = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let states: Vec<[f64; 3]> = time_s.iter().map(|t| at(*t)).collect();
        let position = states.iter().map(|s| s[0] + 1e-6 * random.gauss()).collect();
        let force = states
            .iter()
            .map(|[_, v, a]| 95.0 * a + 200.0 * v + 20.4 * (v / 1e-3).tanh() + 0.5 * random.gauss())
            .collect();
        let acceleration = states.iter().map(|s| s[2]).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![
            channel("position_m", position),
            channel("force_N", force),
            channel("acceleration", acceleration),
        ];
        let trial = Trial { name: format!("r{trial}.csv"), time_s, channels };
        let start_s = 60.0 * if trial.name == "r0.csv" { 0.0 } else { 1.0 };
        let split = if start_s > 0.0 { Split::Test } else { Split::Fit };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    (0..trials).map(one).collect()
}

#[test]
fn friction_is_found_from_the_inverse_form_at_a_difference_of_positions() {
    let spec = ProblemSpec {
        stages: vec![StageEntry {
            name: "drive".into(),
            output: "force_N".into(),
            inputs: vec!["acceleration".into()],
            position: Some("position_m".into()),
            ..StageEntry::default()
        }],
        parameters: vec![parameter("mass", "kg", 90.0, Tolerance::Relative(0.1))],
        wrap: vec!["output.friction".into(), "output.lag".into(), "output.curve".into()],
        trials: rail(2),
        ..ProblemSpec::default()
    };
    let problem = Checked::new(spec).unwrap();
    let a = problem.session().column("acceleration").unwrap().to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        Ok(a[..ask.trials * SAMPLES].iter().map(|a| ask.parameters[0] * a).collect())
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let mut named = diagnosis.named();
    named.sort();
    assert_eq!(
        named,
        ["output.coulomb_friction", "output.viscous_friction"],
        "{}",
        diagnosis.sentence
    );
    let value = |name: &str| {
        let all = &diagnosis.candidates[0].parameters;
        all.iter().find(|p| p.name == name).map(|p| p.value).unwrap()
    };
    // The width of the reversal is a form, which changes the force by a few per cent.
    assert!((value("f") - 20.4).abs() < 1.0, "{}", value("f"));
    assert!((value("b") - 200.0).abs() < 10.0, "{}", value("b"));
}

#[test]
fn a_budget_is_kept_and_what_was_cut_short_is_said() {
    let plant = || hidden().into_iter().find(|(name, _)| *name == "brake").unwrap().1;
    let (whole, runs) = diagnosed(problem(recorded(plant()), &MANY), None);
    assert_eq!(whole.model_runs.unwrap().budget, None);
    let (cut, cut_runs) = diagnosed(problem(recorded(plant()), &MANY), Some(80));
    assert!(cut_runs <= 80 && cut_runs < runs, "{cut_runs} of {runs}");
    assert!(cut.model_runs.unwrap().is_spent);
    assert!(cut.notes.iter().any(|note| note.code == NoteCode::BudgetSpent), "{:?}", cut.notes);
}

#[test]
fn parameters_that_do_nothing_do_the_same_or_stand_at_a_bound_are_said() {
    let mut spec = problem(recorded(|u, _| servo(13.5, 0.1, 0.0, u)), &[]);
    spec.effects.clear();
    // The simulator ignores the inertia; the gear acts like the gain.
    spec.parameters.push(parameter("gear", "1", 1.0, Tolerance::Relative(0.1)));
    spec.parameters.push(parameter("inertia", "kg m2", 3.0, Tolerance::Relative(0.1)));
    let problem = Checked::new(spec).unwrap();
    let measured = problem.session().column("command_V").unwrap().to_vec();
    let source = closure(move |ask: &Ask<'_>| {
        let mut p = ask.parameters.to_vec();
        p[0] *= p[5];
        Ok(servo_of(&Ask { parameters: &p, effects: &[0.0], ..*ask }, &measured))
    });
    let bench = BlackBox::new(problem, Arc::new(source));
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let of = |name: &str| diagnosis.identifiability.iter().find(|p| p.name == name).unwrap();
    assert_eq!(of("inertia").knowledge, Knowledge::Dead);
    assert_eq!(of("gain").like, ["gear"]);
    assert_eq!(of("tau").knowledge, Knowledge::Determined);
    assert_eq!(of("tau").sentence(), None);
    assert!(of("inertia").sentence().unwrap().contains("has no influence"));
}

#[test]
fn what_a_simulator_answers_wrongly_is_told() {
    let with = |answer: fn(Vec<f64>) -> Vec<f64>| {
        let problem = Checked::new(problem(recorded(|u, _| plain(u, 0.0)), &[])).unwrap();
        let measured = problem.session().column("command_V").unwrap().to_vec();
        let source = closure(move |ask: &Ask<'_>| Ok(answer(servo_of(ask, &measured))));
        let bench = BlackBox::new(problem, Arc::new(source));
        diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap_err().to_string()
    };
    let short = with(|y| y[1..].to_vec());
    assert!(short.contains("8999 samples instead of 9000"), "{short}");
    let broken = with(|mut y| {
        y[4000] = f64::NAN;
        y
    });
    assert_eq!(
        broken,
        "stage servo: the simulator gave NaN at 10 s of t1.csv (asked for gain = 10 deg/V, tau = 0.1 s, zero = 0 deg, bias = 0 V, \
         sides = 0)"
    );
}

#[test]
fn wrong_problems_are_refused_with_what_to_do() {
    let refused = |change: fn(&mut ProblemSpec)| {
        let mut spec = problem(recorded(|u, _| plain(u, 0.0)), &[]);
        change(&mut spec);
        Checked::new(spec).unwrap_err().to_string()
    };
    let error = refused(|s| s.wrap = vec!["output.backlahs".into()]);
    assert!(
        error.contains("there is no wrapper output.backlahs (did you mean output.backlash?)"),
        "{error}"
    );
    let error = refused(|s| s.wrap = vec!["output.friction".into()]);
    assert!(error.contains("friction"), "{error}");
    let error = refused(|s| s.stages[0].output = "angle".into());
    assert!(error.contains("there is no column angle"), "{error}");
    let error = refused(|s| s.parameters[2].tolerance = Tolerance::Relative(0.1));
    assert!(error.contains("parameter zero") && error.contains("absolute tolerance"), "{error}");
    let error = refused(|s| s.effects[0].arguments[0].off = None);
    assert!(error.contains("effect brake") && error.contains("give off"), "{error}");
    let error = refused(|s| s.parameters[0].stages = vec!["gear".into()]);
    assert!(error.contains("there is no stage gear; there are servo"), "{error}");
}

#[test]
fn what_one_sine_cannot_part_is_told_as_a_family() {
    let sine = |t: f64| 5.0 * (2.0 * t).sin();
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(5, trial as u64);
        let time_s: Vec<f64> = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let late = |t: &f64| 3.0 * sine(t - 0.12) + 0.02 * random.gauss();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let shown = time_s.iter().map(late).collect();
        let rod = time_s.iter().map(|t| sine(*t)).collect();
        let channels = vec![channel("rod_mm", rod), channel("shown_mm", shown)];
        let trial = Trial { name: format!("s{trial}.csv"), time_s, channels };
        SessionTrial::new(trial)
    };
    let spec = ProblemSpec {
        stages: vec![StageEntry {
            name: "sensor".into(),
            output: "shown_mm".into(),
            inputs: vec!["rod_mm".into()],
            ..StageEntry::default()
        }],
        parameters: vec![parameter("gain", "1", 3.0, Tolerance::Relative(0.1))],
        wrap: vec!["output.skew".into(), "output.lag".into(), "output.curve".into()],
        trials: vec![one(0)],
        ..ProblemSpec::default()
    };
    let problem = Checked::new(spec).unwrap();
    let rod = problem.session().column("rod_mm").unwrap().to_vec();
    let source =
        closure(move |ask: &Ask<'_>| Ok(rod.iter().map(|x| ask.parameters[0] * x).collect()));
    let bench = BlackBox::new(problem, Arc::new(source));
    let (diagnosis, _) = diagnose(&bench, &Options::default(), &|_| (), &|| false).unwrap();
    let answer = &diagnosis.answer;
    let [MissingEffect { family: Some(family), .. }] = answer.effects() else {
        panic!("{answer:?}")
    };
    assert!(family.names.contains(&"output.skew".to_owned()), "{family:?}");
    assert!(family.names.contains(&"output.lag".to_owned()), "{family:?}");
    let [low, high] = family.range;
    assert!(low < 0.122 && high > 0.118 && high - low < 0.02, "{family:?}");
    let late = "The simulator lacks an effect that makes shown_mm late by 120";
    assert!(diagnosis.sentence.starts_with(late), "{}", diagnosis.sentence);
    assert!(answer.probability() > Some(0.95), "{}", diagnosis.sentence);
}
