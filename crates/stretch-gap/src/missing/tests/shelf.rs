//! Tests of the library of terms as a whole.

use super::{inputs, roles, signal, wave};
use crate::missing::{
    library::library,
    proposed::{scales, words},
    sparse::choice,
    term::{Factor, Passage, Term},
    term_inputs::TermInputs,
};
use crate::problem::sample_roles::Role;
use std::collections::BTreeSet;

/// Three signals: a state, a second state that is not a function of the first, and a command.
fn three() -> TermInputs {
    let other: Vec<f64> = (0..600).map(|i| 0.5 + 0.4 * (0.031 * f64::from(i)).sin()).collect();
    let command: Vec<f64> = (0..600).map(|i| f64::from(i / 60 % 2)).collect();
    let signals = vec![
        signal("rod", wave(600), false),
        signal("pressure", other, false),
        signal("valve", command, true),
    ];
    inputs(signals, &[300, 300])
}

#[test]
fn no_term_stands_in_it_twice_and_each_has_its_words() {
    let inputs = three();
    for is_commanded in [false, true] {
        let terms = library(&inputs, &roles(&[300, 300], 0), is_commanded);
        let scales = scales(&inputs);
        let told: BTreeSet<String> = terms.iter().map(|t| format!("{:?}", t)).collect();
        assert_eq!(told.len(), terms.len(), "a term twice would be paid for twice");
        let words: BTreeSet<String> = terms.iter().map(|t| words(t, &scales)).collect();
        assert!(words.iter().all(|w| !w.is_empty()));
        // The words give shapes (widths, times, knees) with three digits. All shapes in the library
        // differ in these digits.
        assert_eq!(words.len(), terms.len());
    }
}

#[test]
fn every_term_is_finite_on_what_is_recorded() {
    let inputs = three();
    for term in library(&inputs, &roles(&[300, 300], 0), true) {
        let values = term.values(&inputs, 2);
        assert!(values.len() == 600 && values.iter().all(|x| x.is_finite()), "{term:?}");
    }
}

/// Every term refers to an existing signal, and its shapes are finite and positive.
#[test]
fn terms_speak_of_what_was_recorded() {
    let inputs = three();
    for term in library(&inputs, &roles(&[300, 300], 0), true) {
        assert!(term.shapes().iter().all(|s| s.is_finite() && *s > 0.0), "{term:?}");
        let written = serde_json::to_value(&term.factors).expect("written");
        let mut all = vec![&written];
        while let Some(value) = all.pop() {
            if let Some(signal) = value.get("signal") {
                assert!(signal.as_u64().is_some_and(|s| s < 3), "{term:?}");
            }
            all.extend(value.as_array().into_iter().flatten());
            all.extend(value.as_object().into_iter().flat_map(|o| o.values()));
        }
    }
}

#[test]
fn what_leaks_through_openings_is_only_where_commands_drive() {
    let inputs = three();
    let is_leak = |t: &Term| matches!(t.passage, Passage::Leak { .. });
    let of = |is_commanded| library(&inputs, &roles(&[300, 300], 0), is_commanded);
    assert!(!of(false).iter().any(is_leak) && of(true).iter().any(is_leak));
    // With one signal there are no products of two signals, so the library is less than half as
    // long.
    let alone = super::inputs(vec![signal("rod", wave(300), false)], &[300]);
    let terms = library(&alone, &roles(&[300], 0), false);
    assert!(terms.len() < of(false).len() / 2);
}

/// The library contains squares, cubes, products of two signals, sines and memories.
#[test]
fn the_usual_causes_are_on_the_shelf() {
    use Factor::{Play, Power, Sine};
    let terms = library(&three(), &roles(&[300, 300], 0), false);
    let holds = |factors: &[Factor]| terms.contains(&Term::new(factors, Passage::Direct));
    let power = |signal, power| Power { signal, power };
    assert!(holds(&[]) && holds(&[power(0, 2.0)]) && holds(&[power(0, 3.0)]));
    assert!(holds(&[power(0, 1.0), power(1, 1.0)]), "a product of two signals");
    assert!(holds(&[Sine { signal: 0, turns: 2.0 }]));
    assert!(holds(&[Play { signal: 0, width: 0.1 }]));
}

/// Quantiles, at which the kinks of `Above` and `Below` are placed, are computed from the fitted
/// samples only.
#[test]
fn quantiles_are_those_of_fitted_samples() {
    let x: Vec<f64> = (0..100).map(|i| if i < 60 { f64::from(i) / 59.0 } else { 50.0 }).collect();
    let inputs = inputs(vec![signal("x", x, false)], &[100]);
    let roles = roles(&[100], 40);
    assert_eq!(inputs.quantile(0, 0.0, &roles), 0.0);
    assert_eq!(inputs.quantile(0, 1.0, &roles), 1.0);
    let middle = inputs.quantile(0, 0.5, &roles);
    assert!((middle - 0.5).abs() < 0.02, "{middle}");
}

/// If too few samples are held out, every third trial is held out as well. The numbers of fitted
/// and held-out samples still add up to the original number.
#[test]
fn terms_are_chosen_by_samples_that_were_not_fitted() {
    let enough = roles(&[400, 400, 400], 100);
    assert_eq!(choice(&enough).segments, enough.segments);
    let none = roles(&[400; 5], 0);
    let chosen = choice(&none);
    assert_eq!(chosen.count(Role::Held), 2 * 400);
    assert_eq!(chosen.count(Role::Fit) + chosen.count(Role::Held), none.count(Role::Fit));
    let held: Vec<usize> = chosen.of_role(Role::Held).map(|s| s.trial).collect();
    assert_eq!(held, [1, 4]);
}
