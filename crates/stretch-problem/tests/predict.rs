//! A fix predicts recordings that were not fitted, and reports where they leave the fitted ranges.

use std::sync::Arc;

use stretch_data::{Channel, SessionTrial, Trial};
use stretch_gap::RandomGenerator;
use stretch_problem::{
    Ask, Card, CardColumn, CardOutput, EffectEntry, Parameter, Prediction, ProblemSpec, StageEntry,
    Tolerance, closure, predict_with,
};

const DT_S: f64 = 0.01;
const SAMPLES: usize = 2000;

/// A shaft that is turned by hand with the amplitude `far` and the relative speed `quick`, and the
/// gear behind it with a play of 0.4 and a ratio of 3.05.
fn recorded(number: u64, far: f64, quick: f64) -> SessionTrial {
    let mut random = RandomGenerator::new(8, number);
    let phase = number as f64;
    let shaft = |t: f64| far * ((0.9 * quick * t + phase).sin() + 0.6 * (2.3 * quick * t).sin());
    let time_s: Vec<f64> = (0..SAMPLES).map(|i| DT_S * i as f64).collect();
    let shafts: Vec<f64> = time_s.iter().map(|t| shaft(*t)).collect();
    let mut held = 3.05 * shafts[0];
    let gears = shafts.iter().map(|x| {
        held = held.clamp(3.05 * x - 0.4, 3.05 * x + 0.4);
        held + 0.02 * random.gauss()
    });
    let channel = |name: &str, values| Channel { name: name.into(), values };
    let channels = vec![channel("gear_deg", gears.collect()), channel("shaft_deg", shafts)];
    let trial = Trial { name: format!("{number}.csv"), time_s, channels };
    SessionTrial { start_s: 60.0 * number as f64, ..SessionTrial::new(trial) }
}

fn predicted(new: &[(f64, f64)], play: f64) -> Prediction {
    predicted_with(new, play, |_| ())
}

fn predicted_with(new: &[(f64, f64)], play: f64, change: impl Fn(&mut ProblemSpec)) -> Prediction {
    let mut trials = vec![recorded(0, 10.0, 1.0), recorded(1, 10.0, 1.0)];
    let numbered = new.iter().zip(2..);
    trials.extend(numbered.map(|((far, quick), n)| recorded(n, *far, *quick)));
    let mut spec = ProblemSpec {
        stages: vec![StageEntry {
            name: "gear".into(),
            output: "gear_deg".into(),
            inputs: vec!["shaft_deg".into()],
            ..StageEntry::default()
        }],
        parameters: vec![Parameter {
            name: "ratio".into(),
            unit: "1".into(),
            value: 3.05,
            tolerance: Tolerance::Relative(0.05),
            alone: Some(3.03),
            ..Parameter::default()
        }],
        wrapped: vec![EffectEntry {
            name: "output.backlash".into(),
            parameters: [("w".to_owned(), play), ("softness".to_owned(), 0.0)].into(),
        }],
        trials,
        ..ProblemSpec::default()
    };
    change(&mut spec);
    // The measured shaft drives the gear, so the closure holds the recorded shaft.
    let shafts: Vec<f64> =
        spec.trials.iter().flat_map(|t| t.trial.channels[1].values.iter().copied()).collect();
    let gear = closure(move |ask: &Ask<'_>| {
        Ok(shafts[..ask.trials * SAMPLES].iter().map(|x| ask.parameters[0] * x).collect())
    });
    let fitted = if spec.trials.len() > new.len() { 2 } else { 0 };
    predict_with(spec, fitted, Arc::new(gear)).expect("a prediction")
}

/// A card that states an error of 1.02 times the noise, and the ranges of the first two recordings.
fn card() -> Card {
    let output = CardOutput { column: "gear_deg".into(), rmse: 0.0204, times_noise: 1.02 };
    let column = |name: &str, far: f64| CardColumn {
        name: name.into(),
        values: [-far, far],
        rates: [-25.0 * far, 25.0 * far],
    };
    let columns = vec![column("gear_deg", 50.0), column("shaft_deg", 16.0)];
    Card { outputs: vec![output], columns, ..Card::default() }
}

#[test]
fn a_card_holds_for_a_machine_of_the_same_kind_without_the_fitted_recordings() {
    let checked = |new: &[(f64, f64)], play: f64| {
        predicted_with(new, play, |spec| {
            spec.card = Some(card());
            spec.stages[0].noise = Some(0.02);
            spec.trials.drain(..2);
        })
    };
    let found = checked(&[(9.5, 1.0), (8.0, 0.9)], 0.4);
    assert_eq!((found.trials.len(), found.holds), (2, Some(true)), "{}", found.sentence());
    assert!(found.sentence().starts_with("The fix holds for these recordings. With backlash"));
    let far = checked(&[(15.0, 1.0)], 0.4);
    assert_eq!(far.trials[0].extrapolated.len(), 2, "{:?}", far.trials[0].extrapolated);
    let other = checked(&[(9.5, 1.0)], 0.6);
    assert_eq!(other.holds, Some(false), "{}", other.sentence());
    assert!(other.sentence().starts_with("The fix does not hold"), "{}", other.sentence());
    assert_eq!(predicted(&[(9.5, 1.0)], 0.4).holds, None);
}

#[test]
fn the_right_fix_predicts_within_the_noise_and_the_bare_simulator_does_not() {
    let found = predicted(&[(9.5, 1.0), (8.0, 0.9)], 0.4);
    assert_eq!(
        (found.trials.len(), found.effects.as_slice()),
        (2, &["output.backlash".to_owned()][..])
    );
    assert!((0.9..1.1).contains(&found.largest_times_noise), "{}", found.sentence());
    // The play is 0.4 and the noise 0.02, so the error without the fix is some twenty times the noise.
    assert!(found.outputs().all(|o| o.rmse_without > 10.0 * o.noise && o.ratio < 0.1));
    assert!(
        found.trials.iter().all(|t| t.extrapolated.is_empty()),
        "{:?}",
        found.trials[0].extrapolated
    );
    assert!(found.sentence().contains("predicts 2 of 2 outputs better"), "{}", found.sentence());
}

#[test]
fn a_wrong_fix_is_no_better() {
    let found = predicted(&[(9.5, 1.0)], 1.2);
    assert!(found.ratio > 1.0 && found.largest_times_noise > 10.0, "{}", found.sentence());
}

#[test]
fn columns_and_rates_outside_the_fitted_ranges_are_listed() {
    let found = predicted(&[(9.5, 1.0), (15.0, 1.0), (9.0, 2.0)], 0.4);
    let of = |trial: usize| &found.trials[trial].extrapolated;
    let has = |trial: usize, what: &str| of(trial).iter().any(|s| s.starts_with(what));
    assert!(of(0).is_empty(), "{:?}", of(0));
    assert!(has(1, "shaft_deg is ") && has(1, "gear_deg is "), "{:?}", of(1));
    assert!(has(2, "the rate of shaft_deg is "), "{:?}", of(2));
    assert!(of(2).iter().all(|s| s.starts_with("the rate of ")), "{:?}", of(2));
}

/// Without re-tuned values of their own the errors without the fix are too large. A fix without effects, and exact
/// parameters, need no such values.
#[test]
fn parameters_that_were_not_re_tuned_are_noted() {
    let notes = |change: &dyn Fn(&mut ProblemSpec)| {
        let found = predicted_with(&[(9.5, 1.0)], 0.4, |spec| {
            spec.parameters[0].alone = None;
            change(spec);
        });
        (found.sentence(), found.notes.iter().any(|note| note.contains("(alone)")))
    };
    assert!(notes(&|_| ()).1);
    assert!(!notes(&|spec| spec.parameters[0].tolerance = Tolerance::Exact).1);
    let (sentence, is_noted) = notes(&|spec| spec.wrapped.clear());
    assert!(!is_noted && sentence.starts_with("The fix has no effect"), "{sentence}");
}
