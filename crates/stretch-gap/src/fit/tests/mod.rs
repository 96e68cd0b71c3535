//! Fits of toys whose answers are known in closed form.

mod least_squares;
mod marginal;
mod noise;

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    toys::Measured,
};

static GO_ON: fn() -> bool = || false;

/// A toy prepared as a diagnosis prepares it.
pub(crate) fn prepared(measured: &Measured) -> PreparedProblem<'_> {
    PreparedProblem::prepare(measured, &GO_ON, 1, &|_: &str| ()).expect("a problem")
}

/// The re-tuned nominal with some effects at some values, not yet fitted.
pub(crate) fn with_effects(
    problem: &PreparedProblem<'_>,
    effects: &[(usize, Vec<f64>)],
) -> Hypothesis {
    let mut set = problem.nominal.clone();
    set.effects = effects.iter().map(|(effect, _)| *effect).collect();
    set.model.effects = effects.to_vec();
    set
}
