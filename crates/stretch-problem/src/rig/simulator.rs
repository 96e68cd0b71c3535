//! What a diagnosis asks of the rig.

use stretch_gap::{
    Column, Description, Distortion, GapError, Line, Model, Motion, ParameterSpec, Recorded,
    RowsUsed, Run, Simulator,
};
use stretch_sim::{Key, Stage};

use super::{RigSimulator, nominal::Knob, run, smooth::Smoothed, timing};
use crate::bench::acting::lines;

impl Simulator for RigSimulator {
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        &self.measured[stage]
    }

    fn is_lost(&self) -> &[bool] {
        &self.is_lost
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
        if !timing::is_slow(self.session.dt_s()) {
            return Vec::new();
        }
        let timing = |(i, knob): (usize, &Knob)| match knob {
            Knob::Lead(which) => Some((i, timing::anywhere(*which))),
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

    /// The openings, and pressure and length smoothed as the stages see them.
    fn recorded(&self) -> Vec<Recorded> {
        let trials = &self.session.trials;
        let signal = |name: &str, unit: &str, is_command, values: Vec<f64>| Recorded {
            name: name.into(),
            unit: unit.into(),
            values,
            is_command,
        };
        let smooth = |all: &[Smoothed]| all.iter().flat_map(|s| &s.values).copied().collect();
        let mut out = vec![
            signal("inlet", "1", true, trials.iter().flat_map(|t| &t.inlet).copied().collect()),
            signal("outlet", "1", true, trials.iter().flat_map(|t| &t.outlet).copied().collect()),
            signal("length_mm", "mm", false, smooth(&self.inputs.length)),
        ];
        if !self.inputs.pressure.is_empty() {
            out.push(signal("pressure_kpa", "kPa", false, smooth(&self.inputs.pressure)));
        }
        out
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        if self.input(run.stage).is_none() {
            return Ok(false);
        }
        run::simulate(self, run, Some(input), out)?;
        Ok(true)
    }

    fn columns(&self) -> Vec<Column<'_>> {
        self.record()
    }

    fn put_right(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        Ok(self.driven(column, error).map(|rig| Box::new(rig) as Box<dyn Simulator + Send>))
    }
}
