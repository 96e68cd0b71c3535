//! Criteria for accepting an effect: more than chance, more than a gap that counts, more than model
//! discrepancy.
//!
//! There are three acceptance criteria, all of them in [`Thresholds`]. First, at least `share` of
//! the gap that is left in the effect's stages closes. Second, the closed part is more than chance
//! makes of noise of this colour: `rise` nats by the [octaves](crate::fit::octaves), and by the
//! score. Third, it is more than *model discrepancy*: the rig's backlash is not the textbook's. An
//! effect in the right place leaves a share `model_discrepancy` of what it closes, with the shape
//! of a further effect, and evidence grows with the samples while that share does not. An effect
//! that closes no more than that share, or that would not count as a gap, may be discrepancy within
//! the noise; it has to raise the score by `faint_rise`. Within the share it also has to leave only
//! noise, and to be more than the share of what was closed in the octaves in which it acts, because
//! a discrepancy has no reason to have the exact form of one further effect. Both sets are also
//! compared with the [deviations](crate::fit::deviations) of their own effects' forms added.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, thresholds::Thresholds},
    search::screen::Screened,
};

/// Share of the remaining gap that a screen must promise for an effect that is to leave only noise.
/// It is below 1 because a screen promises too little if the change is non-linear.
const ALONE: f64 = 0.5;

/// The acceptance criteria of a problem.
#[derive(Clone, Copy)]
pub(crate) struct Acceptance<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) thresholds: &'a Thresholds,
}

impl Acceptance<'_> {
    /// Whether `next`, which has one effect more than `base`, meets every acceptance criterion:
    /// with both unchanged, and with the deviations of their own effects' forms, because what such
    /// a deviation explains is not evidence for a further effect.
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

    /// Whether an effect on top of `base` can explain more than the remaining model discrepancy.
    pub(crate) fn is_possible(&self, base: &Hypothesis, effect: usize) -> bool {
        let mut touched = self.touched(effect).iter();
        touched.any(|&s| self.problem.gap_in(base, s) >= self.discrepancy(base, s))
    }

    /// The same for an effect with a screened gain. It is also promising if it may leave only
    /// noise: if it promises [`ALONE`] of the remaining gap, and that is more than discrepancy in
    /// the octaves.
    pub(crate) fn is_promising(&self, base: &Hypothesis, screened: &Screened) -> bool {
        let Thresholds { model_discrepancy, rise, .. } = *self.thresholds;
        let touched = self.touched(screened.effect).iter();
        let mut rises = touched.map(|&s| self.problem.most_rise(base, s, model_discrepancy));
        let all = self.problem.gain_of(self.left(base, screened.effect));
        self.is_possible(base, screened.effect)
            || (screened.gain() >= ALONE * all && rises.any(|most| most > rise))
    }

    /// Rise of the score that one more effect has to achieve if it closes that much.
    pub(crate) fn least_rise(&self, closed: f64) -> f64 {
        let is_faint = closed < self.thresholds.null_excess;
        if is_faint { self.thresholds.faint_rise } else { self.thresholds.rise }
    }

    /// Remaining gap in the stages that an effect touches.
    pub(crate) fn left(&self, base: &Hypothesis, effect: usize) -> f64 {
        self.touched(effect).iter().map(|&s| self.problem.gap_in(base, s)).sum()
    }

    fn exceeds_discrepancy(&self, base: &Hypothesis, next: &Hypothesis, new: usize) -> bool {
        self.touched(new).iter().any(|&s| {
            let closed = self.problem.closes(base, next, s);
            closed > 0.0 && closed >= self.discrepancy(base, s)
        })
    }

    /// Gap that model discrepancy may leave of what a set closes in a stage.
    fn discrepancy(&self, base: &Hypothesis, stage: usize) -> f64 {
        let gap = |set: &Hypothesis| self.problem.gap_in(set, stage);
        self.thresholds.model_discrepancy * (gap(&self.problem.nominal) - gap(base)).max(0.0)
    }

    fn touched(&self, effect: usize) -> &[usize] {
        &self.problem.simulator().effects()[effect].touches
    }
}
