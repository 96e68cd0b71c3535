//! A start from which re-tuned parameters give back what an effect did.
//!
//! Re-tuning takes up what it can of an effect, a valve's dead band by a smaller least opening. The effect then has nothing left to do, and no
//! small step of both leads back. So where a re-tuned parameter stands far from what was told, the effect begins once beside that parameter as
//! shipped, from whichever of its own starts costs least there.

use crate::{
    fit::prepared::PreparedProblem,
    problem::{error::GapError, simulator::Model},
};

/// Tolerances from which a parameter stands far off: one in seven does by chance.
const FAR: f64 = 1.5;

/// A model with one effect more, beside the parameters of its stages as shipped where re-tuning took them far; none where it took none.
pub(crate) fn unstrained(
    problem: &PreparedProblem<'_>,
    base: &Model,
    effect: usize,
) -> Result<Option<Model>, GapError> {
    let simulator = problem.simulator();
    let spec = &simulator.effects()[effect];
    let mut model = base.clone();
    for &p in spec.touches.iter().flat_map(|s| &simulator.stages()[*s].parameters) {
        let (shipped, sd) = (problem.shipped.parameters[p], simulator.parameters()[p].sd);
        if (model.parameters[p] - shipped).abs() > FAR * sd {
            model.parameters[p] = shipped;
        }
    }
    if model.parameters == base.parameters {
        return Ok(None);
    }
    let mut models: Vec<Model> = spec.starts.iter().map(|v| model.with(effect, v)).collect();
    let there = problem.compare.possible_residuals(&spec.touches, &models)?;
    let mut best: Option<(f64, usize)> = None;
    for (i, residuals) in there.iter().enumerate() {
        let Some(residuals) = residuals else { continue };
        let cost = problem.compare.cost(&spec.touches, &models[i], residuals);
        best = best.filter(|b| b.0 <= cost).or(Some((cost, i)));
    }
    Ok(best.map(|(_, i)| models.swap_remove(i)))
}
