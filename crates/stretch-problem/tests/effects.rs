//! Effects are written once: what the simulator runs, the diagnosis finds and the menu of experiments parts; a user's own, too.

use approx::assert_relative_eq;
use stretch_data::{EffectEntry, SessionTrial, Split};
use stretch_effects::Hum;
use stretch_gap::{Laboratory, Model, Options, Simulator, VerdictKind, diagnose, differences};
use stretch_problem::{GaugeSetup, GaugeSimulator, RigSession, RigSetup, RigSimulator};
use stretch_sim::{
    Action, CATALOGUE, Catalogue, Effect, EffectParameter, EffectSet, GaugeRig, GaugeSpec, Rig,
    RunSettings, Tolerance, TrialPlan,
};

/// A charger beside the rig: no effect of the catalogue swings slowly by itself.
static CHARGER: Effect = Effect {
    name: "charger_ripple",
    words: "a charger swings the bridge",
    equation: "v -> v + a sin(2 pi 0.4 Hz t)",
    parameters: &[EffectParameter::strength("a", "V", 0.0, 0.1, 0.02)],
    action: |values, _| Action::Record(Box::new(Hum { a: values[0], f_hz: 0.4, phase: 0.0 })),
    ..Effect::PLAIN
};

/// Arbitrary trials of a rig, the last to test on.
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

/// A gauge alone beside a pressure, so that every effect of a gauge can act.
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

/// Models of one effect each, at the points where it is looked for.
fn models(simulator: &dyn Simulator, effect: usize) -> Vec<Model> {
    let starts = simulator.effects()[effect].starts.iter();
    let with = |values: &Vec<f64>| Model {
        effects: vec![(effect, values.clone())],
        ..Model::nominal(simulator)
    };
    starts.map(with).collect()
}

/// Effects that change no experiment of the menu at any point where they are looked for.
fn unseen<L: Laboratory>(simulator: &L) -> Vec<String> {
    let menu = simulator.menu();
    let nominal = Model::nominal(simulator);
    let plain: Vec<_> = menu.iter().map(|(_, x)| simulator.predict(&nominal, x).unwrap()).collect();
    let is_seen = |effect: usize| {
        models(simulator, effect).iter().any(|model| {
            let mut all = menu.iter().zip(&plain);
            all.any(|((_, x), plain)| simulator.predict(model, x).unwrap() != *plain)
        })
    };
    let names = simulator.description().effects.iter().enumerate();
    names.filter(|(i, _)| !is_seen(*i)).map(|(_, e)| e.name.clone()).collect()
}

#[test]
fn every_effect_changes_an_experiment() {
    let rig = simulator(&Rig::default(), 1, &Catalogue::default());
    assert_eq!(rig.description().effects.len(), CATALOGUE.len());
    assert_eq!(unseen(&rig), [""; 0]);
    assert_eq!(unseen(&gauge()), [""; 0]);
}

#[test]
fn every_effect_can_be_told_by_an_experiment() {
    let rig = simulator(&Rig::default(), 1, &Catalogue::default());
    for (i, effect) in rig.description().effects.iter().enumerate() {
        let model = models(&rig, i).pop().unwrap();
        let d = differences(&rig, &model, &Model::nominal(&rig)).unwrap();
        assert!(d.iter().all(|x| x.1.is_finite()), "{}: {d:?}", effect.name);
        assert!(d.iter().any(|x| x.1 > 0.0), "{} is told by nothing: {d:?}", effect.name);
    }
}

#[test]
fn what_a_diagnosis_answers_is_what_a_simulation_takes() {
    let rig = simulator(&Rig::default(), 1, &Catalogue::default());
    for effect in &rig.description().effects {
        for start in &effect.starts {
            let names = effect.parameters.iter().map(|p| p.name.as_str());
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
    for effect in &gauge().description().effects {
        for start in &effect.starts {
            let names = effect.parameters.iter().map(|p| p.name.clone());
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
    assert_eq!(simulator.description().effects.last().unwrap().name, "charger_ripple");
    let options = Options { depth: 1, ..Options::default() };
    let (diagnosis, _) = diagnose(&simulator, &options, &|_| (), &|| false).unwrap();
    assert_eq!(diagnosis.verdict, VerdictKind::Effect, "{}", diagnosis.sentence);
    assert_eq!(diagnosis.named, ["charger_ripple"]);
    let a = &diagnosis.candidates[0].parameters[0];
    // The noise of 6000 samples leaves the amplitude to a hundredth.
    assert_relative_eq!(a.value, 0.02, epsilon = 0.0, max_relative = 0.02);
    let before = Catalogue::default().without(&["charger_ripple"]);
    assert!(before.is_err());
}
