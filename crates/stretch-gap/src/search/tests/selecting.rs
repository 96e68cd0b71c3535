//! Tests of forward selection and backward elimination.

use super::{index, names};
use crate::{
    fit::tests::{prepared, with_effects},
    problem::thresholds::Thresholds,
    search::selection::Search,
    toys::{Effect, Law, Measured, Toy},
};

type Hidden = (Effect, &'static [f64]);

/// Pairs of effects with an excess of about six each. The model discrepancy of one effect is less
/// than a thirtieth of the other effect's excess.
const PAIRS: [[Hidden; 2]; 4] = [
    [(Effect::Play, &[0.04]), (Effect::Quadratic, &[0.2])],
    [(Effect::Cubic, &[0.4]), (Effect::Drift, &[0.0005])],
    [(Effect::Quadratic, &[0.15]), (Effect::Creep, &[0.15, 1.0])],
    [(Effect::Cubic, &[0.4]), (Effect::Quadratic, &[0.15])],
];

fn best_of(record: &Measured, from: &[(&str, Vec<f64>)], depth: usize) -> Vec<String> {
    let (problem, thresholds) = (prepared(record), Thresholds::frozen());
    let mut search = Search::new(&problem, &thresholds, depth);
    let effects: Vec<_> = from.iter().map(|(name, v)| (index(record, name), v.clone())).collect();
    let from = with_effects(&problem, &effects);
    let best = search.best(&from, &|_: &str| ()).expect("a search");
    names(&problem, &best)
}

fn expected(hidden: &[Hidden]) -> Vec<String> {
    let mut expected: Vec<String> = hidden.iter().map(|(e, _)| e.name().to_owned()).collect();
    expected.sort();
    expected
}

#[test]
fn two_hidden_effects_are_found_and_not_a_third() {
    let mut wrong = Vec::new();
    for hidden in PAIRS {
        for law in [Law::Line, Law::Oscillator] {
            let record = Toy::of(&[law]).may_lack(&Effect::ALL).hiding(&hidden).measured(1);
            let best = best_of(&record, &[], 4);
            if best != expected(&hidden) {
                wrong.push((law, hidden, best));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// At most `depth` effects are selected: with depth 1 the stronger of two, with depth 0 none.
#[test]
fn no_more_effects_are_taken_than_asked_for() {
    let record = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&PAIRS[0]).measured(1);
    assert_eq!(best_of(&record, &[], 1).len(), 1);
    assert_eq!(best_of(&record, &[], 0), [""; 0]);
}

/// A search that starts from a set with a superfluous effect removes this effect.
#[test]
fn a_superfluous_effect_is_eliminated() {
    let mut wrong = Vec::new();
    for hidden in PAIRS {
        for spare in Effect::ALL.into_iter().filter(|e| hidden.iter().all(|(own, _)| own != e)) {
            let record = Toy::of(&[Law::Line]).may_lack(&Effect::ALL).hiding(&hidden).measured(2);
            let start = spare.spec(0).starts[0].clone();
            let mut from: Vec<(&str, Vec<f64>)> =
                hidden.iter().map(|(e, values)| (e.name(), values.to_vec())).collect();
            from.push((spare.name(), start));
            let best = best_of(&record, &from, 4);
            if best != expected(&hidden) {
                wrong.push((hidden, spare, best));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Effects in stages that share nothing are each found in their own stage.
#[test]
fn effects_of_two_stages_are_found_in_their_stages() {
    let mut toy = Toy::of(&[Law::Lag, Law::Line]);
    let all = [Effect::Play, Effect::Quadratic, Effect::Cubic, Effect::Creep];
    toy.catalogue = [0, 1].into_iter().flat_map(|s| all.map(|e| (s, e))).collect();
    toy.hidden = vec![(0, Effect::Creep, vec![0.15, 1.0]), (1, Effect::Play, vec![0.1])];
    assert_eq!(best_of(&toy.measured(3), &[], 4), ["creep", "play_1"]);
}
