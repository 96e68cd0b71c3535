//! Whether commands switch at rows of the record or anywhere between two: two hypotheses, weighed
//! by what each explains in the end.
//!
//! If every second row of a record was dropped, a switch is visible up to a row late. Then the
//! [parameter](crate::RecordFacts::command_timing) that says how far ahead of its row a switch acts
//! on average is re-tuned, and the variation between switches is a marginalised nuisance. A true
//! effect (a late valve) gains from this freedom as well, as long as it is not in the model.
//! Therefore both hypotheses are searched to the end, and the better likelihood of the records
//! decides.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{
        altered_parameters::Altered, error::GapError, simulator::Simulator, spec::ParameterSpec,
        thresholds::Thresholds,
    },
    search::selection::Search,
};

/// A simulator whose commands switch between rows; `None` if it has no such commands.
pub(crate) fn between_rows(simulator: &dyn Simulator) -> Option<Altered<'_>> {
    let timing = &simulator.record().command_timing;
    let altered = |i: usize, p: &ParameterSpec| {
        let other = timing.iter().find(|(index, _)| *index == i);
        other.map_or(p, |(_, spec)| spec).clone()
    };
    (!timing.is_empty()).then(|| Altered::of(simulator, altered))
}

/// The problem with the larger likelihood of the records, and the set to continue from. The problem
/// with commands between rows is prepared only if there are such commands and a gap that they could
/// explain.
pub(crate) fn likelier<'a>(
    at_rows: PreparedProblem<'a>,
    between_rows: Option<&'a Altered<'a>>,
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
    progress("when commands switch");
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
