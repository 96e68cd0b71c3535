//! A hypothesis for what the catalogue lacks: a function of what was recorded, in place of all
//! effects.
//!
//! A sum of k terms with j shapes, chosen among M and fitted together with the nominal parameters,
//! is scored as every set of effects, and is penalised for the choice:
//!
//! ```text
//! S_f = sum over stages of (N/2m) ln(X_nominal/X) - ((k + j)/2) ln(blocks) - k ln M - d
//! ```
//!
//! where d is what [deviations](crate::fit::deviations) of the forms of its effects add to the best
//! set. A sum of any terms has to explain more than another form of the effects would. If it does,
//! the cause is outside the catalogue.

use crate::{
    evidence::{gathered::Evidence, probability::Function},
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    missing::Proposal,
    problem::{error::GapError, sample_roles::Role, thresholds::Thresholds},
};

/// The score of a proposed sum of terms in place of all effects, to be compared with the best set
/// of effects; `None` if no sum of terms was found that predicts anything.
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
