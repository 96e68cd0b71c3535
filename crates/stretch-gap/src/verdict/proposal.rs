//! What the catalogue lacks, where a gap is left: sums of terms, instead of the named effects and beside them.
//!
//! What a known cause leaves because its form is another, and what an unknown cause leaves, are two hypotheses: the named effects with a sum of
//! terms beside them, and a sum of terms alone. The names stand where the first closes more of the held-out gap.
//!
//! A gap that is random in time may be noise. So may be one that is smaller than what noise of a measured input makes of it, though it
//! follows that input: the noise does so, too, where the input rests and nothing else moves it.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem, score::gap},
    missing::{Proposed, propose},
    problem::error::GapError,
};

/// Sums of terms outside the catalogue.
#[derive(Debug, Default)]
pub(crate) struct Lacking {
    /// The sum that closes the gap of the re-tuned nominal.
    pub(crate) instead: Option<Proposed>,
    /// The sum that closes what the best set leaves, where that was asked for.
    pub(crate) beside: Option<Proposed>,
    /// Whether the first closes more than the best set and the second do together.
    pub(crate) beats_names: bool,
    /// Whether what is left is random in time, or no larger than what noise of a measured input makes.
    pub(crate) is_like_noise: bool,
}

impl Lacking {
    /// Proposes a sum instead of the best set of effects, and one beside it where the set has `names`.
    pub(crate) fn of(
        problem: &PreparedProblem<'_>,
        best: &Hypothesis,
        names: bool,
        progress: &dyn Fn(&str),
    ) -> Result<Self, GapError> {
        progress("what the catalogue lacks");
        let instead = propose(problem, &problem.nominal)?;
        let is_random = instead.as_ref().is_some_and(|p| p.random);
        let is_like_noise = is_random || problem.is_transmitted(best);
        let beside = if names { propose(problem, best)? } else { None };
        let (other, own) = (instead.as_ref(), beside.as_ref());
        let beats_names = names && other.is_some_and(|other| beats(problem, best, other, own));
        Ok(Self { instead, beside, beats_names, is_like_noise })
    }
}

/// Whether a sum closes more of its stage's held-out gap than the best set does with `own` beside it.
fn beats(
    problem: &PreparedProblem<'_>,
    best: &Hypothesis,
    other: &Proposed,
    own: Option<&Proposed>,
) -> bool {
    let mut stages = problem.simulator().stages().iter();
    let Some(stage) = stages.position(|s| s.name == other.stage) else { return false };
    let held = |h: &Hypothesis| gap(h.misfits[stage].held);
    let whole = held(&problem.nominal).max(f64::MIN_POSITIVE);
    let own = own.filter(|own| own.stage == other.stage);
    let left = held(best) / whole * (1.0 - own.map_or(0.0, |p| p.closes_held));
    other.closes_held > 1.0 - left
}
