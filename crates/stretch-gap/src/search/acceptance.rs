//! What an effect must bring to be taken: more than chance, more than what counts, more than model discrepancy.
//!
//! Three acceptance criteria, all of them in [`Thresholds`]. What is closed is more than chance makes of noise of this colour, and more than *model
//! discrepancy*: the rig's backlash is not the textbook's; an effect in the right place leaves a share `model_discrepancy` of what it closes, in the
//! octaves in which it closes it, and evidence grows with the samples while that share does not. Beyond that share the further effect brings `rise`
//! nats by the [octaves](crate::fit::octaves). The score rises by as much, and by `faint_rise` where what is closed would not count as a gap: so little
//! may be model discrepancy within the noise. At least `share` of the gap that is left in the effect's stages closes.
//! Both sets stand beside each other with the [deviations](crate::fit::deviations) of their own effects' forms as well.

use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, thresholds::Thresholds},
};

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
        let all = 0..base.misfits.len();
        let closed: f64 = all.map(|stage| self.problem.closes(base, next, stage)).sum();
        next.score - base.score > self.least_rise(closed)
            && self.problem.rise(base, next, self.thresholds.model_discrepancy)
                > self.thresholds.rise
            && closed >= self.thresholds.share * self.left(base, new)
    }

    /// Whether an effect on top of `base` can be more than what model discrepancy left: in a stage in which nothing acts yet, or where
    /// more is left than that.
    pub(crate) fn is_possible(&self, base: &Hypothesis, effect: usize) -> bool {
        let specs = self.problem.simulator().effects();
        let is_free = |s: &usize| base.effects.iter().all(|e| !specs[*e].touches.contains(s));
        let (discrepancy, rise) = (self.thresholds.model_discrepancy, self.thresholds.rise);
        let is_left = |s: &usize| self.problem.most_rise(base, *s, discrepancy) > rise;
        self.touched(effect).iter().any(|s| is_free(s) || is_left(s))
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

    fn touched(&self, effect: usize) -> &[usize] {
        &self.problem.simulator().effects()[effect].touches
    }
}
