//! Simulated channels that replace channels without a measurement; a result is cached for runs with
//! the same causes.

use std::sync::Arc;

use stretch_sim::{Actuation, Grid, Openings, RigStage, Start};

use super::{
    cache::{Pressures, causes},
    run::Setting,
};
use crate::error::ProblemError;

impl Setting<'_> {
    /// For each trial, the chamber's pressure at every node, if it does not depend on the muscle.
    /// Runs that differ only in the muscle share it.
    pub(super) fn chamber_kpa(
        &self,
        stage: &Actuation,
        count: usize,
    ) -> Result<Arc<Pressures>, ProblemError> {
        let begun = self.begun(count);
        let key = causes(&[RigStage::Pneumatics], &self.params, &self.effects, &self.grid, begun);
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

    /// The part of the length that play in the reference hides. The simulated motion shows which side of the play is in
    /// contact; the recorded length then gives the length of the muscle.
    pub(super) fn hidden(&self, count: usize) -> Result<Option<Vec<f64>>, ProblemError> {
        let alone = self.effects.only(|e| e.hides_input());
        if alone.acting_in(RigStage::Reference).next().is_none() {
            return Ok(None);
        }
        let mut free = self.free_length(count)?.to_vec();
        let mut shown = self.shown(&alone)?;
        shown.condition(&[self.before_mm(); 2])?;
        self.set_reference_state(&mut shown, free.get(..1).unwrap_or(&[]))?;
        self.each(count, &mut free, |trial, own| {
            let before = own.to_vec();
            shown.run(self.start(trial), own)?;
            own.iter_mut().zip(before).for_each(|(shown, free)| *shown = free - *shown);
            Ok(())
        })?;
        Ok(Some(free))
    }

    /// Simulated length without play in the reference, mm.
    fn free_length(&self, count: usize) -> Result<Arc<Vec<f64>>, ProblemError> {
        let effects = self.effects.only(|e| !e.hides_input());
        let has_pressure = self.rig.inputs.pressure.is_some();
        let grid = if has_pressure {
            Grid::samples(self.rig.bench.about.dt_s)?
        } else {
            effects.grid(&self.params, self.rig.bench.about.dt_s, self.step_s)?
        };
        let initial_share = self.initial_muscle;
        let without =
            Setting { rig: self.rig, params: self.params, effects, grid, initial_share, ..*self };
        let make = || {
            let mut all = vec![0.0; self.samples(count)];
            match has_pressure {
                true => without.muscle(count, &mut all)?,
                false => without.actuation(count, &mut all)?,
            }
            Ok(all)
        };
        // A length that depends on a draw of the noise, or on a given input, is needed only once, so it is not cached.
        if self.input_noise.is_some() || self.given.is_some() {
            return make().map(Arc::new);
        }
        let stages = [RigStage::Pneumatics, RigStage::Muscle, RigStage::Reference];
        let others = self.begun(count).chain([initial_share]);
        let key = causes(&stages, &without.params, &without.effects, &without.grid, others);
        self.rig.found.lengths.or_make(key, make)
    }

    /// The numbers that a run depends on in addition to parameters and effects: leads of the
    /// commands, and pressures at the start of the first trials.
    fn begun(&self, count: usize) -> impl Iterator<Item = f64> {
        self.leads.into_iter().chain((0..count).map(|trial| self.initial_kpa(trial)))
    }

    /// Number of samples in the first trials.
    fn samples(&self, count: usize) -> usize {
        self.rig.bench.columns.ranges[..count].last().map_or(0, |range| range.end)
    }

    /// Pressure of the nominal pneumatics, kPa, for recordings without a pressure column.
    pub(super) fn simulated_pressure(&self, count: usize) -> Result<Arc<Pressures>, ProblemError> {
        let effects = &self.rig.bench.effects;
        let grid = effects.grid(&self.params, self.rig.bench.about.dt_s, self.step_s)?;
        let nominal = Setting { rig: self.rig, effects: effects.clone(), grid, ..*self };
        let make = || {
            let mut all = vec![0.0; self.samples(count)];
            nominal.pneumatics(count, &mut all)?;
            let ranges = self.rig.bench.columns.ranges[..count].iter();
            Ok(ranges.map(|range| all[range.clone()].to_vec()).collect())
        };
        // If the chamber depends on the length, it depends on the draw of its noise and on a given
        // length.
        if self.input_noise.is_some() || self.given.is_some() {
            return make().map(Arc::new);
        }
        let others = self.begun(count);
        let key = causes(&[RigStage::Pneumatics], &nominal.params, effects, &nominal.grid, others);
        self.rig.found.samples.or_make(key, make)
    }
}
