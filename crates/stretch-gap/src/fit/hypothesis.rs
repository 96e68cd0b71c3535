//! A hypothesis: the effects that the rig is assumed to have and the simulator lacks, with all
//! fitted parameters.

use crate::{
    fit::{score::Misfit, spread::Spread},
    problem::{simulator::Model, spec::EffectSpec},
};

/// A set of effects, fitted together with every nominal parameter. The hypothesis with an empty set
/// is the re-tuned nominal simulator.
#[derive(Debug, Clone)]
pub(crate) struct Hypothesis {
    /// Indices of the effects, in the order in which they were added.
    pub(crate) effects: Vec<usize>,
    /// The simulator's parameters and effects at the maximum of the posterior.
    pub(crate) model: Model,
    /// Misfit of the model in each stage.
    pub(crate) misfits: Vec<Misfit>,
    /// How precisely the parameters are known.
    pub(crate) spread: Spread,
    /// Log-likelihood ratio to the re-tuned nominal simulator, nats, with penalties: see
    /// [`crate::fit::score`].
    pub(crate) score: f64,
}

impl Hypothesis {
    /// Whether a parameter of an effect is at an end of its range. The effect may then compensate
    /// for another cause.
    pub(crate) fn is_at_bound(&self, effect: usize, catalogue: &[EffectSpec]) -> bool {
        self.model.effect(effect).is_some_and(|values| catalogue[effect].is_at_bound(values))
    }

    /// The largest standard deviation of any parameter of an effect.
    pub(crate) fn greatest_sd(&self) -> f64 {
        let sd = |effect, index, value| self.spread.of_effect(effect, index, value);
        let all = self.model.effects.iter().flat_map(|(effect, values)| {
            values.iter().enumerate().map(move |(index, value)| sd(*effect, index, *value))
        });
        all.fold(0.0, f64::max)
    }
}
