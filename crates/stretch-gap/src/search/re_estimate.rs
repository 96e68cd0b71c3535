//! Re-estimates the nuisances (drift and offsets) of a recording, given the effects that were
//! found.
//!
//! A larger nuisance of a stage may explain the same as an effect of that stage. Therefore two
//! hypotheses are compared by their likelihoods. One is the best set of effects, with nuisances
//! estimated for it. The other is that set without the effects in stages with nuisances, with
//! nuisances estimated for this smaller set.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::error::GapError,
    search::sets::Sets,
};

/// Returns the problem with the re-estimated nuisances, and the set to continue from; `None` if the
/// nuisances do not change.
pub(crate) fn re_estimated<'a>(
    problem: &PreparedProblem<'a>,
    sets: &mut Sets<'_>,
    best: &Hypothesis,
    seed: u64,
) -> Result<Option<(PreparedProblem<'a>, Hypothesis)>, GapError> {
    let mut bare = best.clone();
    for effect in best.effects.iter().copied().filter(|e| problem.is_in_loose_stage(*e)) {
        bare = sets.without(&bare, effect)?;
    }
    let beside_best = problem.adapted(&best.model, seed)?;
    if bare.effects.len() == best.effects.len() {
        return Ok(beside_best.map(|problem| (problem, best.clone())));
    }
    let Some(beside_bare) = problem.adapted(&bare.model, seed)? else {
        return Ok(beside_best.map(|problem| (problem, best.clone())));
    };
    let own = beside_best.as_ref().unwrap_or(problem);
    let (levels, others) = (own.levels(best)?, beside_bare.levels(&bare)?);
    let levels: Vec<f64> = levels.iter().zip(&others).map(|(a, b)| a.min(*b)).collect();
    if beside_bare.likelihood(&bare, &levels)? > own.likelihood(best, &levels)? {
        return Ok(Some((beside_bare, bare)));
    }
    Ok(beside_best.map(|problem| (problem, best.clone())))
}
