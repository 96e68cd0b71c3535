//! What an effect must bring to be taken: more than chance, more than what counts, more than model discrepancy.
//!
//! Three acceptance criteria, all of them in [`Thresholds`]. At least `share` of the gap that is left in the effect's stages closes. What is closed is
//! more than chance makes of noise of this colour: `rise` nats by the [octaves](crate::fit::octaves), and by the score. And it is more than *model
//! discrepancy*: the rig's backlash is not the textbook's; an effect in the right place leaves a share `model_discrepancy` of what it closes, with the shape of
//! a further effect, and evidence grows with the samples while that share does not. What closes no more than that share, or would not count as a gap, so that it may be
//! discrepancy within the noise, has to raise the score by `faint_rise`. Within the share it has to leave noise alone as well, and to be more than the share of
//! what was closed in the octaves in which it acts: a discrepancy has no reason to have the very form of one further effect.
//! Both sets stand beside each other with the [deviations](crate::fit::deviations) of their own effects' forms as well.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, thresholds::Thresholds},
    search::screen::Screened,
};

/// Share of all that is left that a screen must promise of an effect which is to leave noise alone: where the change bends it promises too little.
const ALONE: f64 = 0.5;

/// The acceptance criteria of a problem.
#[derive(Clone, Copy)]
pub(crate) struct Acceptance<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) thresholds: &'a Thresholds,
}

impl Acceptance<'_> {
    /// Whether `next`, which has one effect more than `base`, meets every acceptance criterion: as both are, and with the deviations of their own
    /// effects' forms, for what a deviation of the first explains is no further effect's.
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

    /// Whether an effect on top of `base` can be more than what model discrepancy left.
    pub(crate) fn is_possible(&self, base: &Hypothesis, effect: usize) -> bool {
        let mut touched = self.touched(effect).iter();
        touched.any(|&s| self.problem.gap_in(base, s) >= self.discrepancy(base, s))
    }

    /// The same of an effect of which a screen promises a gain, or whether it may leave noise alone: it promises [`ALONE`] of all that is left there, and that is
    /// more than discrepancy in the octaves.
    pub(crate) fn is_promising(&self, base: &Hypothesis, screened: &Screened) -> bool {
        let Thresholds { model_discrepancy, rise, .. } = *self.thresholds;
        let touched = self.touched(screened.effect).iter();
        let mut rises = touched.map(|&s| self.problem.most_rise(base, s, model_discrepancy));
        let all = self.problem.gain_of(self.left(base, screened.effect));
        self.is_possible(base, screened.effect)
            || (screened.gain() >= ALONE * all && rises.any(|most| most > rise))
    }

    /// Rise of the score that one effect more has to bring, if it closes that much.
    pub(crate) fn least_rise(&self, closed: f64) -> f64 {
        let is_faint = closed < self.thresholds.null_excess;
        if is_faint { self.thresholds.faint_rise } else { self.thresholds.rise }
    }

    /// Gap that is left in the stages that an effect touches.
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
