//! The criteria for adding an effect to a set, with their limits from [`Thresholds`].
//!
//! 1. The effect closes at least the share `share` of the gap that is left in its stages.
//! 2. The score, and the likelihood by [octaves](crate::fit::octaves) of frequency, both rise by
//!    `rise` nats.
//! 3. The effects of the smaller set may leave up to the share `model_discrepancy` of what they
//!    close, because their forms differ from those of the rig. An effect that closes no more than
//!    that, or less than `null_excess`, is added only if the score rises by `faint_rise`. If it
//!    closes no more than that, it must also close most of what is left.
//!
//! The criteria must also hold if [deviations](crate::fit::deviations) from the usual forms of the
//! effects are added to both sets. What a deviation explains is not evidence for a further effect.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, thresholds::Thresholds},
};

/// Share of the remaining gap that an effect must close if it closes no more than model discrepancy.
const MOST: f64 = 0.5;

/// The acceptance criteria of a problem.
#[derive(Clone, Copy)]
pub(crate) struct Acceptance<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) thresholds: &'a Thresholds,
}

impl Acceptance<'_> {
    /// Whether `next`, which has one effect more than `base`, meets every criterion. The criteria
    /// are checked twice, without and with deviations of the effects' forms, because what a
    /// deviation explains is not evidence for a further effect. `deviating` is `base` with
    /// deviations.
    pub(crate) fn is_accepted(
        &self,
        (base, deviating): (&Hypothesis, &Hypothesis),
        next: &Hypothesis,
    ) -> Result<bool, GapError> {
        if !self.meets(base, next) {
            return Ok(false);
        }
        Ok(base.effects.is_empty() || self.meets(deviating, &self.deviating(next)?))
    }

    /// Returns a set with deviations from the usual forms of its effects.
    pub(crate) fn deviating(&self, set: &Hypothesis) -> Result<Hypothesis, GapError> {
        self.problem.with_deviations(set, self.thresholds.discrepancy_amplitude())
    }

    fn meets(&self, base: &Hypothesis, next: &Hypothesis) -> bool {
        let Some(&new) = next.effects.iter().find(|e| !base.effects.contains(e)) else {
            return false;
        };
        let Thresholds { rise, share, .. } = *self.thresholds;
        let all = 0..base.misfits.len();
        let closed: f64 = all.map(|stage| self.problem.closes(base, next, stage)).sum();
        let is_beyond = self.exceeds_discrepancy(base, next, new);
        let (least, of_left) = match is_beyond {
            true => (self.least_rise(closed), share),
            false => (self.thresholds.faint_rise, MOST),
        };
        next.score - base.score > least
            && self.problem.rise(base, next) > rise
            && closed >= of_left * self.left(base, new)
    }

    /// Returns the rise of the score that a further effect must achieve if it closes this much.
    pub(crate) fn least_rise(&self, closed: f64) -> f64 {
        let is_faint = closed < self.thresholds.null_excess;
        if is_faint { self.thresholds.faint_rise } else { self.thresholds.rise }
    }

    /// Returns the remaining gap in the stages that an effect touches.
    pub(crate) fn left(&self, base: &Hypothesis, effect: usize) -> f64 {
        self.touched(effect).iter().map(|&s| self.problem.gap_in(base, s)).sum()
    }

    fn exceeds_discrepancy(&self, base: &Hypothesis, next: &Hypothesis, new: usize) -> bool {
        self.touched(new).iter().any(|&s| {
            let closed = self.problem.closes(base, next, s);
            closed > 0.0 && closed >= self.discrepancy(base, s)
        })
    }

    /// Returns the part of the gap closed by a set in a stage that model discrepancy may leave
    /// open.
    fn discrepancy(&self, base: &Hypothesis, stage: usize) -> f64 {
        let gap = |set: &Hypothesis| self.problem.gap_in(set, stage);
        self.thresholds.model_discrepancy * (gap(&self.problem.nominal) - gap(base)).max(0.0)
    }

    fn touched(&self, effect: usize) -> &[usize] {
        &self.problem.simulator().effects()[effect].touches
    }
}
