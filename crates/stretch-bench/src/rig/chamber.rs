//! The chamber's pressure without a pressure column, kept between runs that differ in the muscle alone.

use std::{num::NonZeroUsize, sync::Arc};

use stretch_sim::{
    ActiveEffect, Actuation, Key, Openings, PARAMETERS, ParameterInfo, Stage, Start,
};

use super::run::Setting;
use crate::{error::BenchError, kept::Kept};

/// By trial, pressure at every node, kPa.
type Pressures = Vec<Vec<f64>>;
/// Effects, and bits of all numbers.
type Causes = (Vec<&'static str>, Vec<u64>);

/// Pressures that are kept, by what they are a function of.
pub(super) type Chambers = Kept<Causes, Pressures>;

/// Chambers that are kept: those of the probes and steps of the fits under way.
pub(super) const CHAMBERS: NonZeroUsize = NonZeroUsize::new(12).expect("not 0");

impl Setting<'_> {
    /// By trial, the chamber's pressure at every node where it does not depend on the muscle: what acts in the muscle alone finds it kept.
    pub(super) fn chamber_kpa(
        &self,
        stage: &Actuation,
        count: usize,
    ) -> Result<Arc<Pressures>, BenchError> {
        let initial: Vec<f64> = (0..count).map(|trial| self.initial_kpa(trial)).collect();
        let key = self.chamber_key(&initial);
        self.rig.chambers.or_make(key, || {
            let mut memory = stage.memory();
            let before = if self.is_vented() { 1e-3 * self.params[Key::PS] } else { 0.0 };
            let shut = Openings { inlet: &[0.0; 2], outlet: &[0.0; 2] };
            stage.run_pressure(&mut memory, Start::Settled, shut, before, &mut Vec::new())?;
            let one = |(trial, initial_kpa): (usize, &f64)| {
                let (start, [inlet, outlet]) = (self.start(trial), self.openings(trial));
                let openings = Openings { inlet: &inlet, outlet: &outlet };
                let mut nodes = Vec::new();
                stage.run_pressure(&mut memory, start, openings, *initial_kpa, &mut nodes)?;
                Ok(nodes)
            };
            initial.iter().enumerate().map(one).collect()
        })
    }

    /// All that the pressure of a chamber is a function of which does not depend on the muscle.
    fn chamber_key(&self, initial_kpa: &[f64]) -> Causes {
        let effects = || self.effects.acting_in(Stage::Pneumatics);
        let acts = effects().next().is_some();
        // Effects know of the scales around them.
        let counts = |info: &&ParameterInfo| {
            info.stage == Stage::Pneumatics || (acts && info.stage == Stage::Muscle)
        };
        let numbers = PARAMETERS
            .iter()
            .filter(counts)
            .map(|info| self.params[info.key])
            .chain(effects().flat_map(|e| e.values().iter().copied()))
            .chain(initial_kpa.iter().copied())
            .chain(self.leads)
            .chain(self.grid.steps().iter().copied())
            .map(f64::to_bits);
        (effects().map(ActiveEffect::name).collect(), numbers.collect())
    }
}
