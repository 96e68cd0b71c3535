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
    let with = |values: &Vec<f64>| {
        let mut model = model.clone();
        model.effects.push((effect, values.clone()));
        model
    };
    let models: Vec<Model> = spec.starts.iter().map(with).collect();
    let wanted: Vec<(usize, &Model)> =
        models.iter().flat_map(|m| spec.touches.iter().map(move |&s| (s, m))).collect();
    let mut there = problem.compare.residuals_of(&wanted, None).into_iter();
    let mut best: Option<(f64, &Model)> = None;
    for model in &models {
        let own: Vec<_> = there.by_ref().take(spec.touches.len()).collect();
        match own.into_iter().collect::<Result<Vec<_>, _>>() {
            Ok(residuals) => {
                let cost = problem.compare.cost(&spec.touches, model, &residuals);
                best = best.filter(|b| b.0 <= cost).or(Some((cost, model)));
            }
            Err(error) if error.ends_all() => return Err(error),
            // What cannot be simulated is no start.
            Err(_) => {}
        }
    }
    Ok(best.map(|(_, model)| model.clone()))
}
