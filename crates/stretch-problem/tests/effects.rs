//! Every effect is defined once: the simulator runs it, the diagnosis finds it, and candidate
//! experiments distinguish it from others. The same holds for a user's own effects.

use std::sync::Arc;

use approx::assert_relative_eq;
use stretch_data::{Channel, EffectEntry, SessionTrial, Split, Trial};
use stretch_effects::{
    Acts, Effect, EffectParameter, Hum, Kind, Language, Place, Quantity, Side, Sketch,
};
use stretch_gap::{
    Laboratory, Model, Options, RandomGenerator, Simulator, VerdictKind, diagnose, differences,
};
use stretch_problem::{
    Ask, BlackBox, Checked, GaugeSetup, GaugeSimulator, Parameter, ProblemSpec, RigSession,
    RigSetup, RigSimulator, StageEntry, closure,
};
use stretch_sim::{
    CATALOGUE, Catalogue, EffectSet, GaugeRig, GaugeSpec, Rig, RunSettings, Tolerance, TrialPlan,
};

/// A charger that adds a slow oscillation to a channel, which no kind of the catalogue does.
static RIPPLE: Kind = Kind {
    name: "ripple",
    words: "a charger swings it",
    equation: "y = x + a sin(2 pi 0.4 Hz t), t since the session began",
    usual: &[Side::Output],
    parameters: |e, unit| vec![EffectParameter::sized("a", unit, 0.0..=0.3 * e.span())],
    operator: |v, _, _| Box::new(Hum { a: v[0], f_hz: 0.4, phase: 0.0 }),
    sketch: Some(|v, _, signals| {
        Sketch::of(signals.x.clone(), "let y = x + A * sin(2.5132741228718345 * t)")
            .beside(Quantity::SESSION_TIME)
            .with("A", v[0], &signals.x.unit)
    }),
    ..Kind::PLAIN
};

/// The same kind as an effect in the recording of the rig.
static CHARGER: Effect = Effect {
    name: "charger_ripple",
    words: "a charger swings the bridge",
    equation: "v -> v + a sin(2 pi 0.4 Hz t)",
    parameters: &[EffectParameter::strength("a", "V", 0.0, 0.1, 0.02)],
    acts: Acts::at(&RIPPLE, Place::Record),
    ..Effect::PLAIN
};

/// Arbitrary trials of a rig; the last one is a test trial if there are several.
fn recorded(rig: &Rig, count: usize) -> Vec<SessionTrial> {
    let mut session = stretch_sim::Session::new(rig, &RunSettings::default()).unwrap();
    let trial = |number: usize| {
        let plan = TrialPlan::arbitrary(number + 1, 5);
        let (entry, mut trial) = session.run(&plan).unwrap();
        trial.time_s.truncate(2500);
        trial.channels.iter_mut().for_each(|c| c.values.truncate(2500));
        let is_test = number > 0 && number + 1 == count;
        let split = if is_test { Split::Test } else { Split::Fit };
        SessionTrial { start_s: entry.start_s, split, ..SessionTrial::new(trial) }
    };
    (0..count).map(trial).collect()
}

fn simulator(rig: &Rig, count: usize, catalogue: &Catalogue) -> RigSimulator {
    let session = RigSession::new(&recorded(rig, count)).unwrap();
    RigSimulator::new(RigSetup { session, rig: Rig::default(), catalogue }).unwrap()
}

/// A gauge alone with a pressure, so that every effect of a gauge can act.
fn gauge() -> GaugeSimulator {
    GaugeSimulator::new(&GaugeSetup {
        trials: &recorded(&Rig::default(), 1),
        reference: "length_mm",
        signal: "bridge_v",
        rig: None,
        catalogue: &Catalogue::default(),
    })
    .unwrap()
}

/// Models with one effect, one for each point at which the search for it begins.
fn models(simulator: &dyn Simulator, effect: usize) -> Vec<Model> {
    let starts = simulator.effects()[effect].starts.iter();
    let with = |values: &Vec<f64>| Model {
        effects: vec![(effect, values.clone())],
        ..Model::nominal(simulator)
    };
    starts.map(with).collect()
}

/// Effects that change no candidate experiment at any point at which the search for them begins.
fn unseen(simulator: &dyn Laboratory) -> Vec<String> {
    let candidates = simulator.experiments();
    let nominal = Model::nominal(simulator);
    let before: Vec<_> =
        candidates.iter().map(|x| simulator.predict(&nominal, &x.trial).unwrap()).collect();
    let is_seen = |effect: usize| {
        models(simulator, effect).iter().any(|model| {
            let mut all = candidates.iter().zip(&before);
            all.any(|(x, before)| simulator.predict(model, &x.trial).unwrap() != *before)
        })
    };
    let names = simulator.description().spec().effects.iter().enumerate();
    names.filter(|(i, _)| !is_seen(*i)).map(|(_, e)| e.name.clone()).collect()
}

#[test]
fn every_effect_changes_an_experiment() {
    let rig = simulator(&Rig::default(), 1, &Catalogue::default());
    assert_eq!(rig.description().spec().effects.len(), CATALOGUE.len());
    assert_eq!(unseen(&rig), [""; 0]);
    assert_eq!(unseen(&gauge()), [""; 0]);
}

#[test]
#[ignore = "every effect in every experiment; ./ci.sh runs it"]
fn every_effect_can_be_told_by_an_experiment() {
    let rig = simulator(&Rig::default(), 1, &Catalogue::default());
    for (i, effect) in rig.description().spec().effects.iter().enumerate() {
        let model = models(&rig, i).pop().unwrap();
        let d = differences(&rig, &model, &Model::nominal(&rig)).unwrap();
        assert!(d.iter().all(|x| x.1.is_finite()), "{}: {d:?}", effect.name);
        assert!(d.iter().any(|x| x.1 > 0.0), "no experiment shows {}: {d:?}", effect.name);
    }
}

#[test]
fn what_a_diagnosis_answers_is_what_a_simulation_takes() {
    let rig = simulator(&Rig::default(), 1, &Catalogue::default());
    for effect in &rig.description().spec().effects {
        for start in &effect.starts {
            let names = effect.parameters.iter().map(|p| &*p.name);
            let given: Vec<(&str, f64)> = names.zip(start.iter().copied()).collect();
            EffectSet::new().insert(&effect.name, &given).unwrap();
        }
    }
    let gauge_file = GaugeRig {
        spec: GaugeSpec {
            zero: 150.0,
            span: 30.0,
            offset: 2.3,
            gain: -1.1,
            pressure_scale: Some(620.0),
        },
        offset: Tolerance::Exact,
        gain: Tolerance::Exact,
        effects: EffectSet::new(),
    };
    for effect in &gauge().description().spec().effects {
        for start in &effect.starts {
            let names = effect.parameters.iter().map(|p| p.name.to_string());
            let parameters = names.zip(start.iter().copied()).collect();
            let mut file = gauge_file.to_file();
            file.effects.push(EffectEntry { name: effect.name.clone(), parameters });
            GaugeRig::from_file(&file).unwrap();
        }
    }
}

#[test]
fn an_effect_of_ones_own_is_simulated_listed_and_named() {
    let mut rig = Rig::default();
    rig.effects.push(&CHARGER, &[0.02]).unwrap();
    let catalogue = Catalogue::default().with(&CHARGER).unwrap();
    let simulator = simulator(&rig, 3, &catalogue);
    assert_eq!(simulator.description().spec().effects.last().unwrap().name, "charger_ripple");
    let options = Options { depth: std::num::NonZeroUsize::new(1).unwrap(), ..Options::default() };
    let (diagnosis, _) = diagnose(&simulator, &options, &|_| (), &|| false).unwrap();
    assert_eq!(diagnosis.verdict(), VerdictKind::Effect, "{}", diagnosis.sentence);
    assert_eq!(diagnosis.named(), ["charger_ripple"]);
    let a = &diagnosis.candidates[0].parameters[0];
    // With the noise of 6000 samples, the amplitude is known to a hundredth.
    assert_relative_eq!(a.value, 0.02, epsilon = 0.0, max_relative = 0.02);
    let before = Catalogue::default().without(&["charger_ripple"]);
    assert!(before.is_err());
    let params = Rig::default().params;
    let grid = stretch_sim::Grid::samples(0.01).unwrap();
    let sketch = CHARGER.sketch(&[a.value], &params.surroundings(&grid)).unwrap();
    let code = sketch.code(Language::Python, CHARGER.name, &[]);
    assert!(code.contains("def charger_ripple(x, t):"), "{code}");
}

#[test]
fn a_kind_of_ones_own_is_wrapped_named_and_printed() {
    let (dt_s, samples) = (0.02, 1500);
    let load = |t: f64| 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
    let trial = |number: usize| {
        let time_s: Vec<f64> = (0..samples).map(|i| dt_s * i as f64).collect();
        let start_s = 40.0 * number as f64;
        let mut random = RandomGenerator::new(5, number as u64);
        let force: Vec<f64> = time_s.iter().map(|t| load(t + start_s)).collect();
        let ripple = |t: f64| 4.0 * (std::f64::consts::TAU * 0.4 * (t + start_s)).sin();
        let shown = force.iter().zip(&time_s);
        let length = shown.map(|(f, t)| 2.0 * f + ripple(*t) + 0.05 * random.gauss()).collect();
        let channel = |name: &str, values| Channel { name: name.into(), values };
        let channels = vec![channel("force_N", force), channel("length_mm", length)];
        let split = if number == 1 { Split::Test } else { Split::Fit };
        let trial = Trial { name: format!("{number}.csv"), time_s, channels };
        SessionTrial { start_s, split, ..SessionTrial::new(trial) }
    };
    let problem = Checked::new(ProblemSpec {
        stages: vec![StageEntry {
            name: "spring".into(),
            output: "length_mm".into(),
            inputs: vec!["force_N".into()],
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "compliance".into(),
            unit: "mm/N".into(),
            value: 2.0,
            tolerance: stretch_problem::Tolerance::Relative(0.1),
            ..Parameter::default()
        }],
        wrap: ["output.ripple", "output.lag", "output.curve"].map(String::from).into(),
        kinds: vec![&RIPPLE],
        trials: vec![trial(0), trial(1)],
        ..ProblemSpec::default()
    })
    .unwrap();
    let force = problem.session().column("force_N").unwrap().to_vec();
    let session = problem.session().clone();
    let spring = closure(move |ask: &Ask<'_>| {
        Ok(force[..session.samples(ask.trials)].iter().map(|f| ask.parameters[0] * f).collect())
    });
    let listed: Vec<&str> =
        problem.description().spec().effects.iter().map(|e| e.name.as_str()).collect();
    let at = listed.iter().position(|name| *name == "output.ripple").unwrap();
    let black_box = BlackBox::new(problem, Arc::new(spring));
    let (diagnosis, _) = diagnose(&black_box, &Options::default(), &|_| (), &|| false).unwrap();
    assert_eq!(diagnosis.named(), ["output.ripple"], "{}", diagnosis.sentence);
    let a = diagnosis.candidates[0].parameters[0].value;
    // With the noise of 1500 samples, the amplitude is known to a thousandth.
    assert_relative_eq!(a, 4.0, epsilon = 0.0, max_relative = 0.005);
    let code = black_box.problem().sketch(at, &[a]).unwrap().code(Language::C, "ripple", &[]);
    assert!(code.contains("double ripple(double x, double t)"), "{code}");
    assert!(code.contains("x (mm): length_mm, as the simulator makes it"), "{code}");
}
