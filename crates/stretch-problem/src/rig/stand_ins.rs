//! What stands in for what was not measured, each kept as long as nothing of its causes moves.

use std::sync::Arc;

use stretch_sim::{Actuation, Grid, Openings, Stage, Start};

use super::{
    found::{Pressures, causes},
    run::Setting,
};
use crate::error::ProblemError;

impl Setting<'_> {
    /// By trial, the chamber's pressure at every node where it does not depend on the muscle: what acts in the muscle alone finds it kept.
    pub(super) fn chamber_kpa(
        &self,
        stage: &Actuation,
        count: usize,
    ) -> Result<Arc<Pressures>, ProblemError> {
        let begun = self.begun(count);
        let key = causes(&[Stage::Pneumatics], &self.params, &self.effects, &self.grid, begun);
        self.rig.found.nodes.or_make(key, || {
            let mut memory = stage.memory();
            let before = self.before_kpa();
            let shut = Openings { inlet: &[0.0; 2], outlet: &[0.0; 2] };
            stage.run_pressure(&mut memory, Start::Settled, shut, before, &mut Vec::new())?;
            let one = |trial| {
                let (start, [inlet, outlet]) = (self.after_pause(trial), self.openings(trial));
                let openings = Openings { inlet: &inlet, outlet: &outlet };
                let mut nodes = Vec::new();
                let initial = self.initial_kpa(trial);
                stage.run_pressure(&mut memory, start, openings, initial, &mut nodes)?;
                Ok(nodes)
            };
            (0..count).map(one).collect()
        })
    }

    /// What play in the reference hides of the length: the model of the motion says which flank it lies on, the record how
    /// long the muscle is.
    pub(super) fn hidden(&self, count: usize) -> Result<Option<Vec<f64>>, ProblemError> {
        let alone = self.effects.only(|e| e.hides_input());
        if alone.acting_in(Stage::Reference).next().is_none() {
            return Ok(None);
        }
        let mut free = self.free_length(count)?.to_vec();
        let mut shown = self.shown(&alone)?;
        shown.condition(&[self.before_mm(); 2])?;
        self.unwind_shown(&mut shown, free.get(..1).unwrap_or(&[]))?;
        self.each(count, &mut free, |trial, own| {
            let before = own.to_vec();
            shown.run(self.start(trial), own)?;
            own.iter_mut().zip(before).for_each(|(shown, free)| *shown = free - *shown);
            Ok(())
        })?;
        Ok(Some(free))
    }

    /// Length that the model of the motion shows without play in the reference.
    fn free_length(&self, count: usize) -> Result<Arc<Vec<f64>>, ProblemError> {
        let effects = self.effects.only(|e| !e.hides_input());
        let has_pressure = !self.rig.inputs.pressure.is_empty();
        let grid = if has_pressure {
            Grid::samples(self.rig.about.dt_s)?
        } else {
            effects.grid(&self.params, self.rig.about.dt_s, self.step_s)?
        };
        let unwound = self.unwound_muscle;
        let without =
            Setting { rig: self.rig, params: self.params, effects, grid, unwound, ..*self };
        let make = || {
            let mut all = vec![0.0; self.samples(count)];
            match has_pressure {
                true => without.muscle(count, &mut all)?,
                false => without.actuation(count, &mut all)?,
            }
            Ok(all)
        };
        // What is shaken or stood in for is asked for once.
        if self.input_noise.is_some() || self.given.is_some() {
            return make().map(Arc::new);
        }
        let stages = [Stage::Pneumatics, Stage::Muscle, Stage::Reference];
        let others = self.begun(count).chain([unwound]);
        let key = causes(&stages, &without.params, &without.effects, &without.grid, others);
        self.rig.found.lengths.or_make(key, make)
    }

    /// How the first trials begin and commands act in them: what a run depends on beside parameters and effects.
    fn begun(&self, count: usize) -> impl Iterator<Item = f64> {
        self.leads.into_iter().chain((0..count).map(|trial| self.initial_kpa(trial)))
    }

    /// Samples of the first trials.
    fn samples(&self, count: usize) -> usize {
        self.rig.about.trials[..count].iter().map(|t| t.samples).sum()
    }

    /// Pressure of the nominal pneumatics: what there is without a pressure column.
    pub(super) fn simulated_pressure(&self, count: usize) -> Result<Arc<Pressures>, ProblemError> {
        let effects = &self.rig.effects;
        let grid = effects.grid(&self.params, self.rig.about.dt_s, self.step_s)?;
        let nominal = Setting { rig: self.rig, effects: effects.clone(), grid, ..*self };
        let make = || {
            let mut all = vec![0.0; self.samples(count)];
            nominal.pneumatics(count, &mut all)?;
            let mut own = Vec::with_capacity(count);
            self.each(count, &mut all, |_, values| {
                own.push(values.to_vec());
                Ok(())
            })?;
            Ok(own)
        };
        // A chamber that follows the length follows its noise and what stands in for it.
        if self.input_noise.is_some() || self.given.is_some() {
            return make().map(Arc::new);
        }
        let others = self.begun(count);
        let key = causes(&[Stage::Pneumatics], &nominal.params, effects, &nominal.grid, others);
        self.rig.found.samples.or_make(key, make)
    }
}
