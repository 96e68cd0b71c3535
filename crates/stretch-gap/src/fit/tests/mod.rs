//! Fits of toy simulators for which the results are known in closed form.

mod least_squares;
mod marginal;
mod noise;

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    toys::Measured,
};

static GO_ON: fn() -> bool = || false;

/// Returns a toy problem, prepared as in a diagnosis.
pub(crate) fn prepared(measured: &Measured) -> PreparedProblem<'_> {
    PreparedProblem::prepare(measured, &GO_ON, 1, &|_: &str| ()).expect("a problem")
}

/// Returns the re-tuned nominal simulator with some effects at the given values, not fitted.
pub(crate) fn with_effects(
    problem: &PreparedProblem<'_>,
    effects: &[(usize, Vec<f64>)],
) -> Hypothesis {
    let mut set = problem.nominal.clone();
    set.effects = effects.iter().map(|(effect, _)| *effect).collect();
    set.model.effects = effects.to_vec();
    set
}
