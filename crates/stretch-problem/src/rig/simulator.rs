//! The rig as the diagnosis sees it.

use stretch_gap::{Description, Distortion, GapError, Line, Model, Run, Simulator};
use stretch_sim::RigStage;

use super::{RigSimulator, run};
use crate::bench::smooth::MeasuredInput;

impl Simulator for RigSimulator {
    fn description(&self) -> &Description {
        &self.bench.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.bench.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(run::simulate(self, run, None, out)?)
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        match self.stage_kinds[stage] {
            RigStage::Muscle => self.inputs.pressure.as_ref().map(MeasuredInput::values),
            RigStage::Sensing => Some(self.inputs.length.values()),
            _ => None,
        }
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
        if stage == self.bench.sensor { self.bench.lines(model) } else { Vec::new() }
    }
}
