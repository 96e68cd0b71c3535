//! What a diagnosis asks of the rig.

use stretch_gap::{
    Description, GapError, Line, Model, Motion, ParameterSpec, RowsUsed, Run, Simulator,
};
use stretch_sim::{Key, Stage};

use super::{RigSimulator, nominal::Knob, run, timing};
use crate::acting::lines;

impl Simulator for RigSimulator {
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        &self.measured[stage]
    }

    fn wander_clock(&self, parameter: usize) -> Option<Vec<u32>> {
        let trials = &self.session.trials;
        match self.knobs[parameter] {
            Knob::Rig(Key::PS) => {}
            Knob::Lead(_) => {
                let all = trials.iter().flat_map(|t| timing::switches(&t.inlet, &t.outlet));
                return Some(all.collect());
            }
            _ => return None,
        }
        // The supply reaches the chamber through the inlet only: while it is shut, the clock stands still.
        let mut clock = Vec::new();
        for trial in trials {
            let mut last = 0;
            for (i, opening) in trial.inlet.iter().enumerate() {
                if *opening > 0.0 {
                    last = i as u32;
                }
                clock.push(last);
            }
        }
        Some(clock)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(run::simulate(self, run, None, out)?)
    }

    fn rows_used(&self) -> RowsUsed {
        RowsUsed { used: self.session.rows.used(), read: self.session.rows.read }
    }

    fn command_timing(&self) -> Vec<(usize, ParameterSpec)> {
        let timing = |(i, knob): (usize, &Knob)| match knob {
            Knob::Lead(which) => Some((i, timing::anywhere(*which, self.session.dt_s()))),
            _ => None,
        };
        self.knobs.iter().enumerate().filter_map(timing).collect()
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        match self.stage_kinds[stage] {
            Stage::Sensing => lines(&self.effects, &self.rows, model, 1.0),
            _ => Vec::new(),
        }
    }

    fn motion(&self) -> Motion<'_> {
        let stage = self.stages().iter().position(|s| s.channel == "length_mm").unwrap_or(0);
        Motion {
            values: &self.measured[stage],
            unit: "mm",
            falling: "inflation",
            rising: "deflation",
        }
    }

    fn sensor(&self) -> Option<usize> {
        self.stage_kinds.iter().position(|kind| *kind == Stage::Sensing)
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        let smooth = match self.stage_kinds[stage] {
            Stage::Muscle => &self.inputs.pressure,
            Stage::Sensing => &self.inputs.length,
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
}
