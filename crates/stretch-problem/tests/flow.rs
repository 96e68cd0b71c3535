//! The whole flow with small simulators: a line, a lag, a delay. The named effect is written into
//! the problem, after which simulator and recordings agree. The results in addition to the
//! diagnosis exist for any simulator.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Split, Trial};
use stretch_gap::{NoteCode, Options, RandomGenerator, VerdictKind};
use stretch_problem::{
    Argument, Ask, BlackBox, Checked, EffectEntry, Examined, Fixed, NoFix, OwnEffect, Parameter,
    Problem, ProblemSpec, RecordedSession, StageEntry, Tolerance, closure,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 1500;

fn shaft(trial: usize, t: f64) -> f64 {
    10.0 * (0.9 * t + trial as f64).sin() + 6.0 * (2.3 * t).sin()
}

/// A small simulator.
type Toy = fn(gain: f64, bend: f64, x: &[f64]) -> Vec<f64>;

fn line(gain: f64, bend: f64, x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| gain * x + bend * x * x).collect()
}

/// A first-order lag of 50 ms, trial by trial.
fn lagging(gain: f64, _bend: f64, x: &[f64]) -> Vec<f64> {
    let kept = (-DT_S / 0.05_f64).exp();
    let one = |x: &[f64]| {
        let mut y = gain * x[0];
        x.iter()
            .map(|x| {
                y = kept * y + (1.0 - kept) * gain * x;
                y
            })
            .collect::<Vec<_>>()
    };
    x.chunks(SAMPLES).flat_map(one).collect()
}

fn play(w: f64, x: &[f64]) -> Vec<f64> {
    let one = |x: &[f64]| {
        let mut held = x[0];
        x.iter()
            .map(|x| {
                held = held.clamp(x - w, x + w);
                held
            })
            .collect::<Vec<_>>()
    };
    x.chunks(SAMPLES).flat_map(one).collect()
}

/// Three trials in which the machine `real` responds to its shaft.
fn recorded(real: impl Fn(&[f64]) -> Vec<f64>) -> Vec<SessionTrial> {
    let one = |trial: usize| {
        let mut random = RandomGenerator::new(7, trial as u64);
        let time_s: Vec<f64> = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
        let x: Vec<f64> = time_s.iter().map(|t| shaft(trial, *t)).collect();
        let y = real(&x).iter().map(|y| y + 0.02 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("gear_deg", y), channel("shaft_deg", x)];
        let recorded = Trial { name: format!("t{trial}.csv"), time_s, channels };
        let split = if trial == 2 { Split::Test } else { Split::Fit };
        SessionTrial { start_s: 60.0 * trial as f64, split, ..SessionTrial::new(recorded) }
    };
    (0..3).map(one).collect()
}

/// A trial of one sine, recorded 0.12 s late: a delay and a lag have the same effect.
fn one_sine() -> Vec<SessionTrial> {
    let sine = |t: f64| 5.0 * (2.0 * t).sin();
    let mut random = RandomGenerator::new(5, 0);
    let time_s: Vec<f64> = (0..SAMPLES).map(|i| i as f64 * DT_S).collect();
    let late = time_s.iter().map(|t| 3.0 * sine(t - 0.12) + 0.02 * random.gauss()).collect();
    let shaft = time_s.iter().map(|t| sine(*t)).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("gear_deg", late), channel("shaft_deg", shaft)];
    vec![SessionTrial::new(Trial { name: "sine.csv".into(), time_s, channels })]
}

/// The problem of the small simulator: its ratio is 3 within 5 %, and it has an effect `bend` of
/// its own.
fn described(trials: Vec<SessionTrial>, wrap: &[&str]) -> ProblemSpec {
    ProblemSpec {
        stages: vec![StageEntry {
            name: "gear".into(),
            output: "gear_deg".into(),
            inputs: vec!["shaft_deg".into()],
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "ratio".into(),
            unit: "1".into(),
            value: 3.0,
            tolerance: Tolerance::Relative(0.05),
            ..Parameter::default()
        }],
        effects: vec![OwnEffect {
            name: "bend".into(),
            arguments: vec![Argument {
                unit: "1/deg".into(),
                range: [-0.1, 0.1],
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

fn problem(spec: ProblemSpec, toy: Toy) -> Problem {
    let checked = Checked::new(spec).expect("a problem");
    let session: RecordedSession = checked.session().clone();
    let source = closure(move |ask: &Ask<'_>| {
        let own = &session.column("shaft_deg").expect("the shaft")[..session.samples(ask.trials)];
        let x = ask.inputs.map_or(own, |inputs| &inputs[0]);
        Ok(toy(ask.parameters[0], ask.effects[0], x))
    });
    BlackBox::new(checked, Arc::new(source)).into()
}

fn examined(spec: ProblemSpec, toy: Toy) -> Examined {
    let options = Options { seed: 5, ..Options::default() };
    problem(spec, toy).examine(&options, true, &|_| (), &|| false).expect("a diagnosis")
}

/// The problem that a fix writes, on the same recordings.
fn fixed(examined: &Examined, trials: Vec<SessionTrial>) -> (ProblemSpec, String) {
    let fix = examined.fix.as_ref().expect("a fix");
    let Fixed::Problem(file) = &fix.file else { panic!("{:?}", fix.file) };
    (ProblemSpec { trials, ..(**file).clone() }, fix.text("fixed.toml".as_ref()))
}

fn agrees(examined: &Examined) -> bool {
    matches!(examined.diagnosis.verdict(), VerdictKind::NoGap | VerdictKind::Parameters)
}

#[test]
fn hidden_play_is_named_written_into_the_problem_and_agrees_then() {
    let trials = recorded(|x| play(0.4, &line(3.05, 0.0, x)));
    let wrap = ["output.backlash", "output.skew", "output.curve"];
    let found = examined(described(trials.clone(), &wrap), line);
    assert_eq!(found.diagnosis.named(), ["output.backlash"], "{}", found.diagnosis.sentence);
    let notes = &found.diagnosis.notes;
    let friction = notes.iter().find(|note| note.code == NoteCode::LooksLikeFriction);
    let begins = "output.backlash: dry friction inside the machine looks alike";
    assert!(friction.expect("a note").to_string().starts_with(begins), "{notes:?}");
    let one = &found.implementations[0];
    assert_eq!((one.name.as_str(), one.stage.as_str()), ("output.backlash", "gear"));
    assert!(
        one.equation().contains("play(x, w") && one.equation().contains("with w = 0."),
        "{}",
        one.equation()
    );
    let (spec, text) = fixed(&found, trials);
    // a prediction states errors in multiples of the noise of the diagnosis
    let (noise, own) = (spec.stages[0].noise.expect("written"), found.evidence.stages[0].noise);
    assert!((noise / own - 1.0).abs() < 1e-3, "{noise} {own}");
    assert_eq!(spec.wrapped.len(), 1);
    assert!((spec.wrapped[0].parameters["w"] - 0.4).abs() < 0.03, "{:?}", spec.wrapped);
    assert!((spec.parameters[0].value - 3.05).abs() < 0.01);
    assert!(text.contains("[[wrapped]]") && text.contains("was 3; 95 %:"), "{text}");
    let again = examined(spec, line);
    assert!(agrees(&again), "{}", again.diagnosis.sentence);
}

#[test]
fn what_stands_in_front_of_a_simulator_is_written_as_well() {
    let late = |x: &[f64]| {
        let shifted: Vec<f64> = (0..x.len()).map(|i| x[i.saturating_sub(6)]).collect();
        lagging(3.0, 0.0, &shifted)
    };
    let trials = recorded(late);
    let found = examined(described(trials.clone(), &["input.delay", "output.backlash"]), lagging);
    assert_eq!(found.diagnosis.named(), ["input.delay"], "{}", found.diagnosis.sentence);
    let (spec, _) = fixed(&found, trials);
    let again = examined(spec, lagging);
    assert!(agrees(&again), "{}", again.diagnosis.sentence);
}

/// Before the delayed command arrives, the plant rests at an idle command that was not recorded.
#[test]
fn a_delayed_command_that_does_not_begin_at_zero_is_no_clock_of_the_output() {
    let late = |x: &[f64]| {
        let shifted: Vec<f64> =
            (0..x.len()).map(|i| i.checked_sub(6).map_or(0.0, |i| x[i])).collect();
        lagging(3.0, 0.0, &shifted)
    };
    let wrap = ["input.delay", "output.delay", "output.skew"];
    let trials = recorded(late);
    let found = examined(described(trials.clone(), &wrap), lagging);
    assert_eq!(found.diagnosis.named(), ["input.delay"], "{}", found.diagnosis.sentence);
    let (spec, _) = fixed(&found, trials);
    let values = &spec.wrapped[0].parameters;
    assert!((values["delay_s"] - 0.06).abs() < 1e-3, "{values:?}");
    assert!((values["empty"] - 1.0).abs() < 0.05, "{values:?}");
    let again = examined(spec, lagging);
    assert!(agrees(&again), "{}", again.diagnosis.sentence);
}

#[test]
fn an_effect_that_the_simulator_has_itself_gets_its_value() {
    let trials = recorded(|x| line(3.0, 0.02, x));
    let found = examined(described(trials.clone(), &["output.backlash"]), line);
    assert_eq!(found.diagnosis.named(), ["bend"], "{}", found.diagnosis.sentence);
    let (spec, text) = fixed(&found, trials);
    let value = spec.effects[0].arguments[0].value.expect("a value");
    assert!((value - 0.02).abs() < 0.001, "{value}");
    assert!(text.contains("value = 0.0"), "{text}");
    let again = examined(spec, line);
    assert!(agrees(&again), "{}", again.diagnosis.sentence);
}

#[test]
fn rivals_are_told_apart_by_an_experiment_that_the_simulator_predicts() {
    let spec = described(one_sine(), &["output.skew", "output.lag"]);
    let found = examined(spec, line);
    assert!(found.diagnosis.ambiguous.len() > 1, "{}", found.diagnosis.sentence);
    let trial = found.experiment.as_ref().expect("an experiment");
    trial.check().expect("a trial");
    let shaft = &trial.channels[0];
    assert_eq!((shaft.name.as_str(), trial.len()), ("shaft_deg", SAMPLES));
    let widest = shaft.values.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    assert!(widest <= 5.0, "within the range that was measured: {widest}");
    let json = found.to_json();
    let next = &json["next_experiment"];
    assert_eq!(next["name"], trial.name.as_str());
    let ambiguous = json["ambiguous"].as_array().expect("a list");
    let separated = next["separates"].as_array().expect("a list");
    assert!(separated.len() > 1 && separated.iter().all(|e| ambiguous.contains(e)), "{next}");
    let d = next["d"].as_f64().expect("a number");
    assert!(d.is_finite() && d > 0.0, "{d}");
}

#[test]
fn the_one_json_has_version_seed_and_what_follows() {
    let trials = recorded(|x| play(0.4, &line(3.0, 0.0, x)));
    let found = examined(described(trials, &["output.backlash"]), line);
    let json = found.to_json();
    assert_eq!((&json["schema"], &json["seed"]), (&2.into(), &5.into()));
    assert_eq!(json["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(json["implement"][0]["effect"], "output.backlash");
    assert!(json["fixed_rig"].is_null());
    assert!(json["fixed_problem"].as_str().expect("a text").contains("[[wrapped]]"));
}

#[test]
fn effects_are_left_out_by_name_by_kind_and_by_place() {
    let trials = recorded(|x| play(0.4, &line(3.0, 0.0, x)));
    let names = |without: &[&str]| {
        let mut spec =
            described(trials.clone(), &["output.backlash", "input.delay", "output.curve"]);
        spec.without = without.iter().map(|w| (*w).to_owned()).collect();
        let checked = Checked::new(spec).map_err(|e| e.to_string())?;
        let effects = &checked.description().spec().effects;
        Ok::<_, String>(effects.iter().map(|e| e.name.clone()).collect::<Vec<_>>())
    };
    assert_eq!(names(&["bend", "curve"]).unwrap(), ["input.delay", "output.backlash"]);
    assert_eq!(names(&["output.all"]).unwrap(), ["bend", "input.delay"]);
    let refused = names(&["outptu.backlash"]).unwrap_err();
    assert!(refused.contains("did you mean output.backlash?"), "{refused}");
}

#[test]
fn a_stage_that_is_a_sensor_tells_what_a_calibration_loses() {
    let trials = recorded(|x| play(4.0, &line(3.0, 0.0, x)));
    let mut spec = described(trials, &["output.backlash"]);
    (spec.reference, spec.signal) = (Some("shaft_deg".into()), Some("gear_deg".into()));
    let found = examined(spec.clone(), line);
    assert!(found.diagnosis.transfer.is_some(), "{}", found.diagnosis.sentence);
    spec.signal = Some("gera_deg".into());
    let refused = Checked::new(spec).unwrap_err().to_string();
    assert!(refused.contains("did you mean gear_deg?"), "{refused}");
}

#[test]
fn nothing_is_written_where_nothing_explains_the_gap() {
    let trials = recorded(|x| x.iter().map(|x| 30.0 * (0.3 * x).sin().abs()).collect());
    let found = examined(described(trials, &["output.backlash"]), line);
    assert!(matches!(found.fix, Err(NoFix::Unknown | NoFix::Record { .. })), "{:?}", found.fix);
    assert!(found.to_json()["fixed_problem"].is_null());
}

#[test]
fn a_problem_file_with_everything_in_it_is_written_and_read_back() {
    let text = r#"
name = "servo"
simulator = { fmu = "a.fmu", variables = { tau = "motor.tau" }, jobs = 2 }
wrap = ["input.delay"]
without = ["curve"]
beside = ["supply_V"]
reference = "rod_mm"
signal = "angle_deg"
budget = 400
[[stage]]
name = "servo"
output = "angle_deg"
inputs = ["command_V"]
noise = 0.1
[[input]]
column = "command_V"
noise = 0.01
[[parameter]]
name = "gain"
unit = "deg/V"
value = 10
tolerance = "10 %"
least = 0
[[parameter]]
name = "tau"
value = 0.1
tolerance = 0.02
stages = ["servo"]
[[effect]]
name = "brake"
range = [0, 3]
off = 0
value = 0.5
[[effect]]
name = "two"
[[effect.argument]]
name = "a"
range = [0.1, 3]
off = 0.1
log = true
[[effect.argument]]
name = "b"
range = [0, 1]
[[wrapped]]
name = "output.backlash"
w = 0.4
softness = 0.2
[[trial]]
file = "monday.csv"
[[trial]]
file = "tuesday.csv"
start_s = 100
split = "test"
"#;
    let file = ProblemSpec::parse("p.toml", text).expect("a problem");
    assert_eq!(file.wrapped[0].parameters["w"], 0.4);
    let again = ProblemSpec::parse("p.toml", &file.to_toml()).expect("the same");
    assert_eq!(again, file, "{}", file.to_toml());
    // Wrappers with missing or unknown values are refused.
    let trials = recorded(|x| line(3.0, 0.0, x));
    let with = |values: &[(&str, f64)]| {
        let mut spec = described(trials.clone(), &[]);
        let values = values.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect();
        spec.wrapped = vec![EffectEntry { name: "output.backlash".into(), parameters: values }];
        Checked::new(spec).map(drop).map_err(|e| e.to_string())
    };
    with(&[("w", 0.4)]).expect("the form is usual where it is left out");
    assert!(with(&[]).unwrap_err().contains("it has no w; write w = VALUE"));
    assert!(with(&[("w", 0.4), ("sofness", 0.1)]).unwrap_err().contains("did you mean softness?"));
}
