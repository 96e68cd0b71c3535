//! Tests of the search on toys: screening, acceptance and removal of effects.

mod acceptance;
mod deviations;
mod screening;
mod selecting;
mod shipped_start;

use crate::{fit::hypothesis::Hypothesis, fit::prepared::PreparedProblem, toys::Measured};

/// Names of the effects of a set, in alphabetical order.
fn names(problem: &PreparedProblem<'_>, set: &Hypothesis) -> Vec<String> {
    let effects = problem.simulator().effects();
    let mut names: Vec<String> = set.effects.iter().map(|e| effects[*e].name.clone()).collect();
    names.sort();
    names
}

fn index(record: &Measured, name: &str) -> usize {
    let catalogue = record.toy.catalogue.iter();
    let mut names = catalogue.map(|(stage, effect)| crate::toys::Toy::name(*stage, *effect));
    names.position(|own| own == name).expect("an effect of that name")
}
