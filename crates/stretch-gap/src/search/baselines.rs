//! Applies simpler methods to the same data, for comparison with the full search. Each omits a part
//! of it:
//!
//! | method | leaves out |
//! | --- | --- |
//! | largest drop | re-tuning: nominal parameters stay as shipped |
//! | signature | the fit: one change of the output, correlated with the residual |
//! | Bayesian information criterion (BIC) | correlation of samples, held-out data, and sets of several effects |

use std::collections::BTreeMap;

use rayon::prelude::*;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    fit::{
        comparison::Comparison,
        hypothesis::Hypothesis,
        levenberg_marquardt::{COARSE, Fitted, possible},
        metric::Metric,
        prepared::PreparedProblem,
        score::Misfit,
    },
    problem::{
        altered::Altered, error::GapError, sample_roles::Role, simulator::Model,
        spec::ParameterSpec,
    },
    search::screen::Ground,
};

/// Answers of simpler methods to the same data.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Baselines {
    /// Effect with the largest reduction of the error, with nominal parameters as shipped.
    pub largest_drop: Option<String>,
    /// Effect whose simulated change correlates best with the residual of the re-tuned simulator,
    /// after the part that a change of the nominal parameters could explain is projected out of
    /// both.
    pub signature: Option<String>,
    /// Single effect with the best Bayesian information criterion. Each effect is fitted jointly with the parameters.
    /// The criterion treats the samples as independent.
    pub bic: Option<String>,
}

/// Number of single effects that the information criterion compares: the best of the screen.
const KEPT: usize = 8;
/// Smallest correlation that counts, in standard deviations: noise alone almost never reaches it. Samples count as
/// independent.
const FAR: f64 = 4.0;
/// Number of starts of an effect that are fitted.
const STARTS: usize = 2;

/// Applies the three simpler methods.
pub(crate) fn baselines(
    problem: &PreparedProblem<'_>,
    tried: &BTreeMap<Vec<usize>, Hypothesis>,
    null_excess: f64,
) -> Result<Baselines, GapError> {
    let name =
        |effect: Option<usize>| effect.map(|e| problem.simulator().effects()[e].name.clone());
    let ground = Ground::around(&problem.compare, problem.nominal.model.clone())?;
    Ok(Baselines {
        largest_drop: name(largest_drop(problem, null_excess)?),
        signature: name(signature(&problem.compare, &ground)?),
        bic: name(criterion(problem, &ground, tried)?),
    })
}

/// Returns the effect that most reduces the mean square error in multiples of the noise if only its
/// own parameters are fitted and all parameters of the simulator stay as shipped. `None` if the
/// reduction is not above `null_excess`.
fn largest_drop(
    problem: &PreparedProblem<'_>,
    null_excess: f64,
) -> Result<Option<usize>, GapError> {
    // In this copy of the problem, no parameter is re-tuned or drifts.
    let compare = &problem.compare;
    let frozen = Altered::of(problem.simulator(), |_, p| ParameterSpec {
        sd: 0.0,
        drift: None,
        per_trial_sd: None,
        per_tick_sd: None,
        ..p.clone()
    });
    let (runs, shipped) = (compare.runs.beside(&frozen), Model::nominal(&frozen));
    let metrics = compare.metrics.iter().enumerate().map(|(stage, metric)| {
        Metric::of(&runs, &compare.roles, stage, metric.noise.clone(), &shipped, Some(metric))
    });
    let rigid = compare.beside(&frozen, metrics.collect::<Result<_, _>>()?);
    let ground = Ground::around(&rigid, shipped)?;
    let before: Vec<Misfit> =
        ground.residuals.iter().enumerate().map(|(s, r)| rigid.misfit(s, r)).collect();
    let drops = each_effect(&rigid, |effect| {
        let mut most = 0.0_f64;
        let fit = |stages: &[usize], model| rigid.fit(stages, model, &ground.known, COARSE);
        for misfits in fits(&rigid, &ground, effect, fit)? {
            let drop = |m: &Misfit| rigid.mean_square(&before[m.stage]) - rigid.mean_square(m);
            most = most.max(misfits.iter().map(drop).sum());
        }
        Ok(most)
    })?;
    Ok(best(drops).filter(|(_, drop)| *drop > null_excess).map(|(effect, _)| effect))
}

/// Returns the effect whose change, simulated once, correlates best with the residual of the
/// re-tuned simulator, after the contribution of the parameters is projected out of both. `None` if
/// noise could correlate as well.
fn signature(compare: &Comparison<'_>, ground: &Ground) -> Result<Option<usize>, GapError> {
    let likeness = each_effect(compare, |effect| {
        let spec = &compare.simulator().effects()[effect];
        let mut most = 0.0_f64;
        for (own, mixed) in compare.changes(ground, effect, &spec.starts)?.into_iter().flatten() {
            most = most.max(mixed.abs() / own.sqrt());
        }
        Ok(most)
    })?;
    let stages = ground.residuals.iter().enumerate();
    let (squares, count) = stages.fold((0.0, 0.0), |(squares, count), (s, residual)| {
        let own = compare.product(s, residual, residual);
        (squares + own, count + compare.roles.count(Role::Fit) as f64)
    });
    // The correlation is r = product/sqrt(own squares). Without a true correlation, its standard
    // deviation is 1/sqrt(count).
    let least = FAR * (squares / f64::max(count, 1.0)).sqrt();
    Ok(best(likeness).filter(|(_, product)| *product > least).map(|(effect, _)| effect))
}

/// Returns the single effect, fitted together with all parameters, with the lowest BIC = n ln(mean
/// square) + k ln(n). Every sample counts as independent. `None` if the model without effects has
/// the lowest BIC (Schwarz 1978, doi 10.1214/aos/1176344136).
fn criterion(
    problem: &PreparedProblem<'_>,
    ground: &Ground,
    tried: &BTreeMap<Vec<usize>, Hypothesis>,
) -> Result<Option<usize>, GapError> {
    let (compare, nominal) = (&problem.compare, &problem.nominal);
    let gains = each_effect(compare, |effect| Ok(compare.screen(ground, effect)?.gain()))?;
    let mut order: Vec<usize> = (0..gains.len()).collect();
    order.sort_by(|a, b| gains[*b].total_cmp(&gains[*a]));
    let samples = compare.roles.count(Role::Fit) as f64;
    let falls = each_effect(compare, |effect| {
        if !order[..KEPT.min(order.len())].contains(&effect) {
            return Ok(0.0);
        }
        let spec = &compare.simulator().effects()[effect];
        let free =
            spec.parameters.iter().filter(|p| p.is_fitted() && p.usual_form().is_none()).count();
        let all = samples * nominal.misfits.len() as f64;
        let fall = |misfits: &[Misfit]| {
            let gain = |m: &Misfit| samples * (nominal.misfits[m.stage].fit / m.fit).ln();
            misfits.iter().map(gain).sum::<f64>() - free as f64 * all.ln()
        };
        let fit = |stages: &[usize], model| problem.fit(stages, model, &ground.known, COARSE);
        let known = tried.get(&vec![effect]).map(|set| vec![set.misfits.clone()]);
        let fitted = match known {
            Some(known) => known,
            None => fits(compare, ground, effect, fit)?,
        };
        Ok(fitted.iter().map(|m| fall(m)).fold(0.0, f64::max))
    })?;
    Ok(best(falls).map(|(effect, _)| effect))
}

/// Computes a number for every effect.
fn each_effect(
    compare: &Comparison<'_>,
    of: impl Fn(usize) -> Result<f64, GapError> + Sync + Send,
) -> Result<Vec<f64>, GapError> {
    (0..compare.simulator().effects().len()).into_par_iter().map(of).collect()
}

/// Returns the effect with the largest number above 0.
fn best(numbers: Vec<f64>) -> Option<(usize, f64)> {
    let above = numbers.into_iter().enumerate().filter(|(_, x)| *x > 0.0);
    above.max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Fits an effect, added to the model of `ground`, from its best starts. Returns for each fit the
/// misfits in the stages that the effect touches.
fn fits(
    compare: &Comparison<'_>,
    ground: &Ground,
    effect: usize,
    fit: impl Fn(&[usize], Model) -> Result<Fitted, GapError> + Sync,
) -> Result<Vec<Vec<Misfit>>, GapError> {
    let mut starts = compare.screen(ground, effect)?.starts;
    starts.truncate(STARTS);
    possible(starts.into_par_iter().map(|(values, _)| {
        let mut model = ground.model.clone();
        model.effects.push((effect, values));
        Ok(fit(&compare.simulator().effects()[effect].touches, model)?.misfits)
    }))
}
