//! What the catalogue lacks, where a gap is left: a sum of terms in the place of effects, or one beside those that are named.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    missing::{Proposed, propose},
    problem::error::GapError,
};

/// The sum of terms that closes what the best set leaves where the set has `names`, else what the re-tuned nominal leaves, which may be `known`
/// already; none that closes less than nothing of the trials that were not fitted.
pub(crate) fn lacking(
    problem: &PreparedProblem<'_>,
    best: &Hypothesis,
    (names, known): (bool, Option<&Proposed>),
    progress: &dyn Fn(&str),
) -> Result<Option<Proposed>, GapError> {
    let found = match known.filter(|_| !names) {
        Some(known) => Some(known.clone()),
        None => {
            progress("what the catalogue lacks");
            let from = if names { best } else { &problem.nominal };
            propose(problem, from)?.map(|proposal| proposal.told)
        }
    };
    Ok(found.filter(|p| p.random || p.terms.is_empty() || p.closes_test > 0.0))
}
