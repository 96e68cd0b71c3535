//! Computes the share of the gap that each effect of the best set closes, so that the report
//! contains these shares even if no effect is named.
//!
//! Effects overlap: the shares that each closes alone may add up to more than the whole. Therefore
//! effects are removed one after the other, from the weakest to the strongest, and the remaining
//! ones are fitted again each time. The share of an effect is (gap without it - gap with it)/gap of
//! the nominal simulator. These shares add up to the share that the whole set closes. They are
//! computed on the test trials, because on fitted trials any effect reduces the residual. The
//! excess that an effect closes (its size) is, like every gap, the larger of the values on fitted
//! and on test trials. The reason is that an effect that acts only in long trials (creep over half
//! a minute) closes little in short ones.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    evidence::gathered::Evidence,
    fit::{
        hypothesis::Hypothesis,
        prepared::PreparedProblem,
        score::{excess, mean_square},
    },
    problem::error::{GapError, unless_lost},
    search::sets::Sets,
};

/// Share of the gap on test trials that one effect of the best set closes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectShare {
    /// Effect.
    pub effect: String,
    /// Share of the re-tuned nominal simulator's gap that opens again when the effect is removed,
    /// after all weaker effects were removed. The shares add up to the share that the set closes.
    pub closes: f64,
    /// Excess that the effect closes in the stage in which it closes most, in variances of the
    /// noise; the larger of the values on fitted and on test trials.
    pub closes_excess: f64,
    /// Whether one of its parameters reached an end of its range. The effect then probably
    /// compensates for another cause.
    pub at_bound: bool,
}

/// Removes the effects of the best set one after the other, the weakest first. Returns each removed
/// effect with the fitted set that remains.
pub(crate) fn eliminated(
    sets: &mut Sets<'_>,
    best: &Hypothesis,
) -> Result<Vec<(usize, Hypothesis)>, GapError> {
    let problem = sets.problem;
    let (mut set, mut out) = (best.clone(), Vec::new());
    while !set.effects.is_empty() {
        let mut weakest: Option<(usize, Hypothesis)> = None;
        for effect in set.effects.clone() {
            let less = sets.without(&set, effect)?;
            if weakest.as_ref().is_none_or(|(_, w)| problem.gap(&less) < problem.gap(w)) {
                weakest = Some((effect, less));
            }
        }
        let Some((effect, less)) = weakest else { break };
        out.push((effect, less.clone()));
        set = less;
    }
    Ok(out)
}

/// Returns the share of the gap on the test trials that each effect closes, the strongest first.
pub(crate) fn shares(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    best: &Hypothesis,
    eliminated: &[(usize, Hypothesis)],
) -> Result<Vec<EffectShare>, GapError> {
    // The noise is known to a few per cent. If the best set leaves less than the estimated noise,
    // excesses are relative to what it leaves.
    let least: Vec<f64> = evidence.stages.iter().map(|s| s.excess_after.min(0.0)).collect();
    let above =
        |stage: usize, blocks: &[f64]| (excess(mean_square(blocks)) - least[stage]).max(0.0);
    let blocks = evidence.nominal_blocks.iter().enumerate();
    let nominal: Vec<f64> = blocks.map(|(stage, blocks)| above(stage, &blocks.test)).collect();
    let whole = nominal.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let mut with: Vec<f64> = evidence.stages.iter().map(|s| s.excess_after.max(0.0)).collect();
    let (mut out, mut whole_set) = (Vec::new(), best);
    for (effect, less) in eliminated {
        let stages = 0..nominal.len();
        let without: Vec<f64> = match less.effects.is_empty() {
            // The nominal simulator was run already.
            true => nominal.clone(),
            false => {
                let left = |s| Ok(above(s, &evidence.blocks(problem, s, &less.model)?.test));
                let left = unless_lost(stages.map(left).collect::<Result<_, GapError>>())?;
                left.unwrap_or_else(|| nominal.clone())
            }
        };
        let closed = without.iter().zip(&with).map(|(without, with)| without - with);
        let fitted =
            (0..nominal.len()).map(|s| problem.closes(less, whole_set, s) / evidence.level(s));
        let spec = &problem.simulator().effects()[*effect];
        out.push(EffectShare {
            effect: spec.name.clone(),
            closes: closed.clone().sum::<f64>() / whole,
            closes_excess: closed.chain(fitted).fold(0.0, f64::max),
            at_bound: best.is_at_bound(*effect, problem.simulator().effects()),
        });
        (with, whole_set) = (without, less);
    }
    out.sort_by(|a: &EffectShare, b| b.closes.total_cmp(&a.closes));
    Ok(out)
}
