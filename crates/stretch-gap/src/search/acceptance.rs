//! The criteria for adding an effect to a set, with their limits from [`Thresholds`].
//!
//! 1. The effect closes at least the share `share` of the gap that is left in its stages.
//! 2. The score, and the likelihood by [octaves](crate::fit::octaves) of frequency, both rise by
//!    `rise` nats. If the effect closes less than `null_excess`, the score must rise by
//!    `faint_rise`.
//! 3. The effect closes more than *model discrepancy*: the effects of the smaller set may leave up
//!    to the share `model_discrepancy` of what they close, even with infinitely many samples,
//!    because their forms differ from those of the rig. An effect that closes no more than that is
//!    added only if the score rises by `faint_rise`, only noise is left, and the rise by octaves
//!    exceeds the discrepancy.
//!
//! The criteria must also hold if [deviations](crate::fit::deviations) from the usual forms of the
//! effects are added to both sets.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, thresholds::Thresholds},
    search::screen::Screened,
};

/// Share of the remaining gap that a screen must promise for an effect that may leave only noise.
/// It is below 1 because a screen underestimates a non-linear change.
const ALONE: f64 = 0.5;

/// The acceptance criteria of a problem.
#[derive(Clone, Copy)]
pub(crate) struct Acceptance<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) thresholds: &'a Thresholds,
}

impl Acceptance<'_> {
    /// Whether `next`, which has one effect more than `base`, meets every criterion. The criteria
    /// are checked twice, without and with deviations of the effects' forms, because what a
    /// deviation explains is not evidence for a further effect.
    pub(crate) fn is_accepted(
        &self,
        base: &Hypothesis,
        next: &Hypothesis,
    ) -> Result<bool, GapError> {
        if !self.meets(base, next) {
            return Ok(false);
        }
        let share = self.thresholds.discrepancy_amplitude();
        let deviating = |set| self.problem.with_deviations(set, share);
        Ok(base.effects.is_empty() || self.meets(&deviating(base)?, &deviating(next)?))
    }

    fn meets(&self, base: &Hypothesis, next: &Hypothesis) -> bool {
        let Some(&new) = next.effects.iter().find(|e| !base.effects.contains(e)) else {
            return false;
        };
        let Thresholds { model_discrepancy, rise, unknown_excess, .. } = *self.thresholds;
        let all = 0..base.misfits.len();
        let closed: f64 = all.map(|stage| self.problem.closes(base, next, stage)).sum();
        let is_beyond = self.exceeds_discrepancy(base, next, new);
        let least = if is_beyond { self.least_rise(closed) } else { self.thresholds.faint_rise };
        let may_be_left = if is_beyond { 0.0 } else { model_discrepancy };
        next.score - base.score > least
            && self.problem.rise(base, next, may_be_left) > rise
            && closed >= self.thresholds.share * self.left(base, new)
            && (is_beyond || self.left(next, new) <= unknown_excess)
    }

    /// Whether an effect that is added to `base` could close more than the remaining model
    /// discrepancy.
    pub(crate) fn is_possible(&self, base: &Hypothesis, effect: usize) -> bool {
        let mut touched = self.touched(effect).iter();
        touched.any(|&s| self.problem.gap_in(base, s) >= self.discrepancy(base, s))
    }

    /// Whether a screened effect is promising: it is possible, or it may leave only noise. For the
    /// latter it must promise [`ALONE`] of the remaining gap, and the rise by octaves beyond
    /// discrepancy must suffice if only noise were left.
    pub(crate) fn is_promising(&self, base: &Hypothesis, screened: &Screened) -> bool {
        let Thresholds { model_discrepancy, rise, .. } = *self.thresholds;
        let touched = self.touched(screened.effect).iter();
        let mut rises = touched.map(|&s| self.problem.most_rise(base, s, model_discrepancy));
        let all = self.problem.gain_of(self.left(base, screened.effect));
        self.is_possible(base, screened.effect)
            || (screened.gain() >= ALONE * all && rises.any(|most| most > rise))
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

    /// Returns the gap that model discrepancy may leave of what a set closes in a stage.
    fn discrepancy(&self, base: &Hypothesis, stage: usize) -> f64 {
        let gap = |set: &Hypothesis| self.problem.gap_in(set, stage);
        self.thresholds.model_discrepancy * (gap(&self.problem.nominal) - gap(base)).max(0.0)
    }

    fn touched(&self, effect: usize) -> &[usize] {
        &self.problem.simulator().effects()[effect].touches
    }
}
