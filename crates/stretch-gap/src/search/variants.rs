//! Variants of a problem, compared by their likelihoods: commands that switch at rows of the
//! recording or anywhere between two rows, and other sizes of the nuisances (drift and offsets).
//!
//! If every second row of a recording was dropped, a switch appears up to a row late. Under the
//! hypothesis that commands switch between rows, the
//! [parameter](crate::RecordFacts::command_timing) for the mean time from a switch to its row is
//! re-tuned, and the variation between switches is a marginalised nuisance. If an effect is missing
//! (such as a late valve), this freedom also improves the fit. Therefore, if this hypothesis is
//! likelier without effects, effects are searched under both hypotheses, and the larger likelihood
//! then decides.
//!
//! A larger nuisance of a stage may explain the same as an effect of that stage. Therefore two
//! hypotheses are compared. One is the best set of effects, with nuisances estimated for it. The
//! other is that set without the effects in stages with nuisances, with nuisances estimated for
//! this smaller set.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{
        altered::Altered, error::GapError, simulator::Simulator, spec::ParameterSpec,
        thresholds::Thresholds,
    },
    search::{selection::Search, sets::Sets},
};

/// Returns the simulator with commands that switch between rows; `None` if the facts about the
/// recording list no parameters for this.
pub(crate) fn between_rows(simulator: &dyn Simulator) -> Option<Altered<'_>> {
    let timing = &simulator.record().command_timing;
    let altered = |i: usize, p: &ParameterSpec| {
        let other = timing.iter().find(|(index, _)| *index == i);
        other.map_or(p, |(_, spec)| spec).clone()
    };
    (!timing.is_empty()).then(|| Altered::of(simulator, altered))
}

/// Returns the problem with the larger likelihood, and the set of effects to continue from. The
/// problem in which commands switch between rows is prepared only if `between_rows` is given and
/// there is a gap in a stage that depends on the timing.
pub(crate) fn likelier<'a>(
    at_rows: PreparedProblem<'a>,
    between_rows: Option<&'a dyn Simulator>,
    (thresholds, depth): (&Thresholds, usize),
    seed: u64,
    progress: &dyn Fn(&str),
) -> Result<(PreparedProblem<'a>, Hypothesis), GapError> {
    let unaltered = at_rows.nominal.clone();
    let Some(between_rows) = between_rows else { return Ok((at_rows, unaltered)) };
    let simulator = at_rows.simulator();
    let timing = &simulator.record().command_timing;
    let is_timed = |stage: &usize| {
        timing.iter().any(|(index, _)| simulator.stages()[*stage].parameters.contains(index))
    };
    let commanded = (0..simulator.stages().len()).filter(is_timed);
    let gap: f64 = commanded.map(|stage| at_rows.gap_in(&at_rows.nominal, stage)).sum();
    if gap < thresholds.null_excess {
        return Ok((at_rows, unaltered));
    }
    progress("testing when commands switch");
    let between = PreparedProblem::prepare(between_rows, at_rows.stop(), seed, progress)?;
    let between = between.retuned_from_starts(thresholds.least_gap, seed)?;
    if between.log_likelihood(&between.nominal) <= at_rows.log_likelihood(&at_rows.nominal) {
        return Ok((at_rows, unaltered));
    }
    let best = |problem: &PreparedProblem<'_>| -> Result<(f64, Hypothesis), GapError> {
        let best = Search::new(problem, thresholds, depth).best(&problem.nominal, progress)?;
        Ok((problem.log_likelihood(&best), best))
    };
    let ((own, from), (other, from_other)) = (best(&at_rows)?, best(&between)?);
    Ok(if other > own { (between, from_other) } else { (at_rows, from) })
}

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
    let beside_bare = match bare.effects.len() < best.effects.len() {
        true => problem.adapted(&bare.model, seed)?,
        false => None,
    };
    if let Some(beside_bare) = beside_bare {
        let own = beside_best.as_ref().unwrap_or(problem);
        let (levels, others) = (own.levels(best)?, beside_bare.levels(&bare)?);
        let levels: Vec<f64> = levels.iter().zip(&others).map(|(a, b)| a.min(*b)).collect();
        if beside_bare.likelihood(&bare, &levels)? > own.likelihood(best, &levels)? {
            return Ok(Some((beside_bare, bare)));
        }
    }
    Ok(beside_best.map(|problem| (problem, best.clone())))
}
