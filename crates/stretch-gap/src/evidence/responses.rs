//! Computes how the output of a stage changes with the parameters of its effects, with one run per
//! parameter value.

use rayon::prelude::*;

use stretch_effects::EffectParameter;

/// Responses of a stage to the parameters of the effects that act in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Responses {
    /// The stage.
    pub stage: usize,
    /// Every varied parameter, in the order of the effects.
    pub parameters: Vec<Response>,
    /// Symmetric matrix of products x'V^-1 y in the metric V of the noise, per sample and averaged
    /// over the blocks of the test trials. The first row belongs to the residual of the best set;
    /// the others belong to the responses, in the order of parameters and values. The first element
    /// is therefore 1 + the excess.
    pub products: Vec<Vec<f64>>,
}

/// Response of a stage to one parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// The effect.
    pub effect: String,
    /// Parameter of that effect.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Fitted value.
    pub fitted: f64,
    /// Values other than the fitted one, in ascending order, and the changes of the output that
    /// they make.
    pub answers: Vec<Answered>,
}

/// The change that one value of the parameter makes.
#[derive(Debug, Clone, PartialEq)]
pub struct Answered {
    /// Value of the parameter.
    pub value: f64,
    /// Output with this value minus output with the fitted value, in the unit of the output, with
    /// all trials concatenated.
    pub output: Vec<f64>,
    /// The same change in multiples of the noise, without slow drift and trial offsets. With this
    /// value, the residual is [`residual_after`](crate::StageEvidence::residual_after) minus this
    /// change.
    pub residual: Vec<f64>,
}

use crate::{
    evidence::gathered::{Evidence, held_out},
    fit::{hypothesis::Hypothesis, levenberg_marquardt::possible, prepared::PreparedProblem},
    numerics::linear::dot,
    problem::{error::GapError, sample_roles::Role},
};

/// Distances of the values from the fitted value, as shares of the reach.
const STEPS: [f64; 6] = [-1.0, -0.5, -0.25, 0.25, 0.5, 1.0];
/// The reach is [`DEVIATIONS`] standard deviations, or the fitted value itself if that is more. For
/// parameters on a logarithmic scale, the reach is a factor of [`RATIO`] in both directions.
const DEVIATIONS: f64 = 3.0;
const RATIO: f64 = 4.0;

/// A varied parameter.
struct Turned<'a> {
    effect: usize,
    parameter: usize,
    spec: &'a EffectParameter,
    fitted: f64,
    values: Vec<f64>,
}

/// Returns the responses of a stage around the best set; `None` if the set has no parameter that
/// acts in the stage and is cheap to vary.
pub(crate) fn responses(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    best: &Hypothesis,
    stage: usize,
) -> Result<Option<Responses>, GapError> {
    let turned = turned(problem, best, stage);
    if turned.is_empty() || problem.is_spent() {
        return Ok(None);
    }
    let (simulator, own) = (problem.simulator(), &evidence.stages[stage]);
    let answer = |at: &Turned<'_>, value: f64| {
        let mut model = best.model.clone();
        let acting = model.effects.iter_mut().filter(|(effect, _)| *effect == at.effect);
        acting.for_each(|(_, values)| values[at.parameter] = value);
        let run = problem.compare.runs.output(stage, &model, simulator.trials().len())?;
        let output: Vec<f64> = run.iter().zip(&own.after).map(|(y, at)| y - at).collect();
        let (whole, residual) = held_out(problem, stage, &best.model, &output);
        Ok((whole, Answered { value, output, residual }))
    };
    let answered = turned
        .par_iter()
        .map(|at| possible(at.values.par_iter().map(|value| answer(at, *value))))
        .collect::<Result<Vec<Vec<_>>, GapError>>()?;
    let (left, clean) = evidence.left(problem, stage);
    let columns: Vec<(&[f64], &[f64])> = std::iter::once((&left[..], &clean[..]))
        .chain(answered.iter().flatten().map(|(whole, one)| (&whole[..], &one.residual[..])))
        .collect();
    let products = products(problem, evidence.level(stage), &columns);
    let parameters = turned.iter().zip(answered).filter(|(_, answers)| !answers.is_empty());
    let parameters = parameters.map(|(at, answers)| Response {
        effect: simulator.effects()[at.effect].name.clone(),
        name: at.spec.name.to_string(),
        unit: at.spec.unit.to_string(),
        fitted: at.fitted,
        answers: answers.into_iter().map(|(_, one)| one).collect(),
    });
    Ok(Some(Responses { stage, parameters: parameters.collect(), products }))
}

/// Returns the parameters of a set's effects that act in a stage and are cheap to vary.
fn turned<'a>(problem: &PreparedProblem<'a>, best: &Hypothesis, stage: usize) -> Vec<Turned<'a>> {
    let simulator = problem.simulator();
    let mut turned = Vec::new();
    for &effect in &best.effects {
        let own = &simulator.effects()[effect];
        let is_costly = simulator.is_costly(effect);
        if !own.touches.contains(&stage) || own.is_found || is_costly {
            continue;
        }
        let fitted = best.model.effect(effect).unwrap_or_default();
        for (parameter, (spec, &fitted)) in own.parameters.iter().zip(fitted).enumerate() {
            let values = values(spec, fitted, best.spread.of_effect(effect, parameter, fitted));
            if spec.is_fitted() && !values.is_empty() {
                turned.push(Turned { effect, parameter, spec, fitted, values });
            }
        }
    }
    turned
}

/// Plausible values around a fitted one.
fn values(spec: &EffectParameter, fitted: f64, sd: f64) -> Vec<f64> {
    let at = |share: f64| match spec.is_log() && fitted > 0.0 {
        true => fitted * libm::pow(RATIO, share),
        false => fitted + share * fitted.abs().max(DEVIATIONS * sd),
    };
    let mut values: Vec<f64> = STEPS.map(|share| at(share).clamp(spec.min, spec.max)).into();
    values.dedup();
    values.retain(|value| *value != fitted && value.is_finite());
    values
}

/// Returns x' V^-1 y of every pair of columns, averaged over the blocks of the test trials. Each
/// element of `columns` holds x and V^-1 x, in multiples of the assumed noise; the actual noise
/// variance is `level` times the assumed one.
fn products(
    problem: &PreparedProblem<'_>,
    level: f64,
    columns: &[(&[f64], &[f64])],
) -> Vec<Vec<f64>> {
    let roles = &problem.compare.roles;
    let blocks: Vec<std::ops::Range<usize>> = roles
        .of_role(Role::Test)
        .flat_map(|s| {
            let count = (s.to - s.from) / roles.block;
            (0..count).map(move |k| s.from + k * roles.block..s.from + (k + 1) * roles.block)
        })
        .collect();
    let samples = (blocks.len() * roles.block).max(1) as f64;
    let product = |x: &[f64], y: &[f64]| {
        blocks.iter().map(|b| dot(&x[b.clone()], &y[b.clone()])).sum::<f64>() / samples / level
    };
    let row = |(i, (x, _)): (usize, &(&[f64], &[f64]))| -> Vec<f64> {
        // V^-1 is symmetric up to rounding, so compute one number for both orders of a pair.
        let pair = |j: usize, y: &[f64]| match j < i {
            true => product(columns[j].0, columns[i].1),
            false => product(x, y),
        };
        columns.iter().enumerate().map(|(j, (_, y))| pair(j, y)).collect()
    };
    columns.iter().enumerate().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_plausible_and_leave_out_the_fitted_one() {
        let strength = EffectParameter::sized("c", "1", 0.0..=1.0);
        assert_eq!(values(&strength, 0.5, 0.0), [0.0, 0.25, 0.375, 0.625, 0.75, 1.0]);
        assert_eq!(values(&strength, 0.5, 0.25), [0.0, 0.125, 0.3125, 0.6875, 0.875, 1.0]);
        assert_eq!(values(&strength, 0.0, 0.0), [0.0; 0]);
        let shape = EffectParameter::shaped("tau", "s", 0.01..=10.0);
        assert_eq!(values(&shape, 5.0, 0.0).last(), Some(&10.0));
        assert_eq!(values(&shape, 1.0, 0.0)[..2], [0.25, 0.5]);
    }
}
