//! A hypothesis: the effects that the rig has and the simulator lacks, with all fitted parameters.

use std::collections::BTreeMap;

use crate::{
    fit::score::Misfit,
    problem::{simulator::Model, spec::EffectSpec},
};

/// A set of effects, fitted together with every nominal parameter; the re-tuned nominal simulator
/// is the one without effects.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    /// Indices of the effects, in the order in which they were added.
    pub(crate) effects: Vec<usize>,
    /// Maximum a posteriori.
    pub(crate) model: Model,
    /// What the model leaves of each stage.
    pub(crate) misfits: Vec<Misfit>,
    /// One standard deviation of the parameters of each effect.
    pub(crate) effect_sd: BTreeMap<usize, Vec<f64>>,
    /// One standard deviation of every nominal parameter that was re-tuned, 0 of the others.
    pub(crate) parameter_sd: Vec<f64>,
    /// Log-likelihood against the re-tuned nominal, nats, with penalties: see [`crate::fit::score`].
    pub(crate) score: f64,
}

impl Hypothesis {
    /// Whether a parameter of an effect is at an end of its range. The effect may then compensate
    /// for something else.
    pub(crate) fn is_at_bound(&self, effect: usize, catalogue: &[EffectSpec]) -> bool {
        self.model.effect(effect).is_some_and(|values| catalogue[effect].is_at_bound(values))
    }
}
