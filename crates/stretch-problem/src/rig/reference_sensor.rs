//! The reference sensor behind a stage: from true length to measured length.

use stretch_sim::{EffectSet, Grid, Memory, Reference, RigParams, RigStage, Start};

use crate::error::ProblemError;

/// The reference sensor behind a stage, skipped if no effect acts in the reference.
pub(super) struct ReferenceSensor {
    pub(super) stage: Reference,
    pub(super) memory: Memory,
    acts: bool,
    work: Vec<f64>,
}

impl ReferenceSensor {
    pub(super) fn new(
        params: &RigParams,
        effects: &EffectSet,
        dt_s: f64,
    ) -> Result<Self, ProblemError> {
        let stage = Reference::new(params, effects, &Grid::samples(dt_s)?)?;
        let acts = effects.acting_in(RigStage::Reference).next().is_some();
        let memory = stage.memory();
        Ok(Self { stage, memory, acts, work: Vec::new() })
    }

    pub(super) fn condition(&mut self, length: &[f64]) -> Result<(), ProblemError> {
        let mut out = vec![0.0; length.len()];
        Ok(self.stage.run(&mut self.memory, Start::Settled, length, &mut out)?)
    }

    pub(super) fn run(&mut self, start: Start, length: &mut [f64]) -> Result<(), ProblemError> {
        if self.acts {
            self.work.clear();
            self.work.extend_from_slice(length);
            self.stage.run(&mut self.memory, start, &self.work, length)?;
        }
        Ok(())
    }

    pub(super) fn undo(&self, length: &mut [f64]) {
        if self.acts {
            self.stage.undo(length);
        }
    }
}
