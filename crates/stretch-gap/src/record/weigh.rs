//! An error of the record beside the best effects.
//!
//! An error has an exact form, so with it hardly more is left than noise, and it has one number. It wins when it stands higher than the
//! best set of effects, by the score that both are held by, and leaves no more than a set that is named may.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::thresholds::Thresholds,
    record::{gross::Gross, suspect::Suspect},
    search::selection::Found,
};

/// No effect of the best set: the rival stands in the place of the whole.
const WHOLE: usize = usize::MAX;
/// Nats within which two errors are a tie.
const TIE: f64 = 1.1;

/// Gap that a set of effects, or an error, may leave.
pub(crate) fn allowed(problem: &PreparedProblem<'_>, thresholds: &Thresholds) -> f64 {
    thresholds.unknown_excess + thresholds.unknown_share * problem.gap(&problem.nominal)
}

/// The errors that stand above the best effects, as they are reported, and what was found with the first of them in its place; none where
/// the effects stand.
pub(crate) fn weighed(
    doubted: &PreparedProblem<'_>,
    suspect: &Suspect<'_>,
    errors: Vec<Hypothesis>,
    found: &Found,
    thresholds: &Thresholds,
) -> Option<(Vec<Gross>, Found)> {
    let allowed = allowed(doubted, thresholds);
    let least = found.best.score.max(thresholds.rise);
    let above = |e: &Hypothesis| e.score > least && doubted.gap(e) <= allowed;
    let mut errors = errors.into_iter().filter(above);
    let first = errors.next()?;
    let (tied, behind): (Vec<Hypothesis>, Vec<Hypothesis>) =
        errors.partition(|e| e.score > first.score - TIE);
    let told = std::iter::once(&first).chain(&tied).filter_map(|e| Gross::found(suspect, e));
    let mut gross: Vec<Gross> = told.collect();
    // Of what these data cannot tell apart, a factor that is that of two units is told first.
    gross.sort_by_key(|g| g.units.is_none());
    let rivals = tied.into_iter().chain(behind).chain([found.best.clone()]);
    let rivals = rivals.map(|rival| (WHOLE, rival)).collect();
    Some((gross, Found { best: first, rivals }))
}
