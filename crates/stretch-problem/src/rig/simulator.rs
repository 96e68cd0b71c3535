//! The rig as the diagnosis sees it.

use stretch_gap::{Description, Distortion, GapError, Line, Model, Run, Simulator};
use stretch_sim::RigStage;

use super::{RigSimulator, run};
use crate::bench::acting::lines;

impl Simulator for RigSimulator {
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        &self.measured[stage]
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(run::simulate(self, run, None, out)?)
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        let smooth = match self.stage_kinds[stage] {
            RigStage::Muscle => &self.inputs.pressure,
            RigStage::Sensing => &self.inputs.length,
            _ => return None,
        };
        Some(smooth.iter().flat_map(|s| &s.values).copied().collect())
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        if self.input(run.stage).is_none() {
            return Ok(false);
        }
        run::simulate(self, run, Some(input), out)?;
        Ok(true)
    }

    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        let rig = self.with_corrected(column, error);
        Ok(rig.map(|rig| Box::new(rig) as Box<dyn Simulator + Send>))
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        match self.stage_kinds[stage] {
            RigStage::Sensing => lines(&self.effects, &self.rows, model, 1.0),
            _ => Vec::new(),
        }
    }
}
