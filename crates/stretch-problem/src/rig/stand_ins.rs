//! Simulated channels that replace channels without a measurement; a result is cached for runs with
//! the same causes.

use std::sync::Arc;

use stretch_sim::{Actuation, Grid, Openings, RigStage, Start};

use super::{
    cache::{ByTrial, Causes, Kept, causes},
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
    ) -> Result<Arc<ByTrial>, ProblemError> {
        let begun = self.begun(count);
        let key =
            causes(&[RigStage::Pneumatics], &self.tuned.params, &self.effects, &self.grid, begun);
        self.rig.found.or_make((Kept::Nodes, key), || {
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

    /// By trial, the part of the length that play in the reference hides. The simulated motion shows which side of the
    /// play is in contact; the recorded length then gives the length of the muscle.
    pub(super) fn hidden(&self, count: usize) -> Result<Option<ByTrial>, ProblemError> {
        let alone = self.effects.only(|e| e.hides_input());
        if alone.acting_in(RigStage::Reference).next().is_none() {
            return Ok(None);
        }
        let mut free = self.free_length(count)?.to_vec();
        let mut shown = self.reference(&alone, &[self.before_mm(); 2])?;
        let initial_shares = self.tuned.initial_muscle;
        let setting = Setting { effects: alone, grid: self.grid.clone(), initial_shares, ..*self };
        for (trial, own) in free.iter_mut().enumerate() {
            let before = own.clone();
            shown.run(&setting, trial, own)?;
            own.iter_mut().zip(before).for_each(|(shown, free)| *shown = free - *shown);
        }
        Ok(Some(free))
    }

    /// Simulated length without play in the reference, mm.
    fn free_length(&self, count: usize) -> Result<Arc<ByTrial>, ProblemError> {
        let effects = self.effects.only(|e| !e.hides_input());
        let has_pressure = self.rig.inputs.pressure.is_some();
        let grid = if has_pressure {
            Grid::samples(self.rig.bench.about.spec().dt_s)?
        } else {
            effects.grid(&self.tuned.params, self.rig.bench.about.spec().dt_s, self.step_s)?
        };
        let initial_shares = self.tuned.initial_muscle;
        let without = Setting { effects, grid, initial_shares, ..*self };
        let stages = [RigStage::Pneumatics, RigStage::Muscle, RigStage::Reference];
        let others = self.begun(count).chain(initial_shares);
        let key = causes(&stages, &without.tuned.params, &without.effects, &without.grid, others);
        self.kept((Kept::Lengths, key), count, |all| match has_pressure {
            true => without.muscle(count, all),
            false => without.actuation(count, all),
        })
    }

    /// Pressure of the nominal pneumatics, kPa, for recordings without a pressure column.
    pub(super) fn simulated_pressure(&self, count: usize) -> Result<Arc<ByTrial>, ProblemError> {
        let effects = self.rig.bench.effects.clone();
        let grid =
            effects.grid(&self.tuned.params, self.rig.bench.about.spec().dt_s, self.step_s)?;
        let others = self.begun(count);
        let key = causes(&[RigStage::Pneumatics], &self.tuned.params, &effects, &grid, others);
        let nominal = Setting { effects, grid, ..*self };
        self.kept((Kept::Samples, key), count, |all| nominal.pneumatics(count, all))
    }

    /// The output of a stage by trial. A result that depends on a draw of the noise, or on a given input, is needed only
    /// once, so it is not kept.
    fn kept(
        &self,
        key: (Kept, Causes),
        count: usize,
        run: impl FnOnce(&mut [f64]) -> Result<(), ProblemError>,
    ) -> Result<Arc<ByTrial>, ProblemError> {
        let ranges = &self.rig.bench.columns.ranges[..count];
        let make = || {
            let mut all = vec![0.0; ranges.last().map_or(0, |range| range.end)];
            run(&mut all)?;
            Ok(ranges.iter().map(|range| all[range.clone()].to_vec()).collect())
        };
        match self.input_noise.is_some() || self.given.is_some() {
            true => make().map(Arc::new),
            false => self.rig.found.or_make(key, make),
        }
    }

    /// The numbers that a run depends on in addition to parameters and effects: leads of the
    /// commands, and pressures at the start of the first trials.
    fn begun(&self, count: usize) -> impl Iterator<Item = f64> {
        self.tuned.leads.into_iter().chain((0..count).map(|trial| self.initial_kpa(trial)))
    }
}
