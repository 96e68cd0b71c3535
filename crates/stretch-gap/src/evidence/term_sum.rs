//! Scores a hypothesis for what the catalogue lacks: a function of the recorded signals, in place
//! of all effects.
//!
//! The function is a sum of k terms, chosen from M terms of a library and fitted together with the
//! nominal parameters. The terms have j shape parameters in total (for example the width of a
//! knee). The sum is scored like a set of effects, and in addition penalised for the choice of its
//! terms:
//!
//! ```text
//! S_f = sum over stages of (N/2m) ln(X_nominal/X) - ((k + j)/2) ln(blocks) - k ln M - d
//! ```
//!
//! Here N, m, X and blocks are those of [`score`](crate::fit::score). d is the rise of the best
//! set's score by [deviations](crate::fit::deviations) of the forms of its effects: a sum of terms
//! has to explain more than other forms of these effects would. If it does, the cause is outside
//! the catalogue.

use crate::{
    evidence::{gathered::Evidence, probability::Function},
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    missing::Proposal,
    problem::{error::GapError, sample_roles::Role, thresholds::Thresholds},
};

/// Returns score and remaining excess of a proposed sum of terms in place of all effects, to be
/// compared with the best set of effects. `None` if no sum of terms was found that predicts
/// anything.
pub(crate) fn weigh_term_sum(
    problem: &PreparedProblem<'_>,
    evidence: &Evidence,
    (proposal, best): (&Proposal, &Hypothesis),
    thresholds: &Thresholds,
) -> Result<Option<Function>, GapError> {
    let terms = &proposal.told.terms;
    if terms.is_empty() {
        return Ok(None);
    }
    let deviating = problem.with_deviations(best, thresholds.discrepancy_amplitude())?;
    let free: usize = terms.iter().map(|term| 1 + term.form.shapes().len()).sum();
    let blocks = problem.compare.roles.blocks(Role::Fit);
    let choice = terms.len() as f64 * (proposal.library as f64).ln();
    let score = problem.ratio(&problem.nominal.misfits, &proposal.misfits)
        - 0.5 * free as f64 * blocks.ln()
        - choice
        - (deviating.score - best.score);
    let tested: f64 = evidence.stages.iter().map(|stage| stage.excess_retuned.max(0.0)).sum();
    let own = evidence.stages[proposal.stage].excess_retuned.max(0.0);
    let tested = tested - proposal.told.closes_test * own;
    let left = evidence.gap_of(problem, &proposal.misfits).max(tested);
    Ok(Some(Function { score, left }))
}
