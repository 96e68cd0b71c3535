//! The one trait through which any simulator is diagnosed.

use crate::{
    coverage::RowsUsed,
    description::Description,
    error::GapError,
    line::Line,
    spec::{EffectSpec, ParameterSpec, StageSpec, TrialSpec},
};

/// Nominal parameters and effects with their values.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// Every nominal parameter, in the simulator's order.
    pub parameters: Vec<f64>,
    /// Effects that are on: index in the catalogue, values.
    pub effects: Vec<(usize, Vec<f64>)>,
}

impl Model {
    /// The simulator as it ships.
    pub fn nominal(simulator: &dyn Simulator) -> Self {
        let parameters = simulator.parameters().iter().map(|p| p.nominal).collect();
        Self { parameters, effects: Vec::new() }
    }

    /// Values of an effect that is on.
    pub fn effect(&self, index: usize) -> Option<&[f64]> {
        self.effects.iter().find(|(i, _)| *i == index).map(|(_, values)| values.as_slice())
    }
}

/// One run of one stage over the session.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Which stage.
    pub stage: usize,
    /// Parameters and effects.
    pub model: &'a Model,
    /// How many of the session's trials, from the first.
    pub trials: usize,
    /// Adds another draw of their noise to the measured inputs, from this seed: tells how much of it arrives at
    /// the output.
    pub shake: Option<u64>,
    /// Share of the usual step of integration: 0.5 for the solver check.
    pub step: f64,
}

/// The measured motion that slices go by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// All trials end to end.
    pub values: &'a [f64],
    /// Unit.
    pub unit: &'a str,
    /// What it is called when the values fall.
    pub falling: &'a str,
    /// What it is called when they rise.
    pub rising: &'a str,
}

/// A simulator bound to the measurements that it is held against.
///
/// Every stage is run alone on its measured input (teacher forcing), so that what one stage gets wrong does not
/// spread to the next. Memories are carried from trial to trial in the order of the session.
///
/// Three methods do: [`Simulator::description`], [`Simulator::measured`] and [`Simulator::simulate`].
pub trait Simulator: Sync {
    /// Stages, parameters, effects and trials in one.
    fn description(&self) -> &Description;
    /// Its stages.
    fn stages(&self) -> &[StageSpec] {
        &self.description().stages
    }
    /// Its nominal parameters.
    fn parameters(&self) -> &[ParameterSpec] {
        &self.description().parameters
    }
    /// The catalogue of effects that it may lack.
    fn effects(&self) -> &[EffectSpec] {
        &self.description().effects
    }
    /// The trials, in the order of the session.
    fn trials(&self) -> &[TrialSpec] {
        &self.description().trials
    }
    /// Sample time, s, the same in every trial.
    fn dt_s(&self) -> f64 {
        self.description().dt_s
    }
    /// Measured output of a stage, all trials end to end.
    fn measured(&self, stage: usize) -> &[f64];
    /// Time, in samples, at which the wander of a parameter last had a way into the outputs, for every sample of all
    /// trials end to end, counted from each trial's start; none when it always has.
    fn wander_clock(&self, _parameter: usize) -> Option<Vec<u32>> {
        None
    }
    /// Simulates a stage on its measured input; effects of other stages in the model are passed over.
    ///
    /// `out` takes the samples of the first `run.trials` trials.
    ///
    /// # Errors
    /// When the simulation is not possible with these values: the fit then turns back.
    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError>;
    /// Rows that the trials stand on, of those that were read; all, where it reads none.
    fn rows_used(&self) -> RowsUsed {
        let used = self.trials().iter().map(|t| t.samples).sum();
        RowsUsed { used, read: used }
    }
    /// Parameters that are exact while commands switch at rows of the record, and what they are where commands switch anywhere
    /// between two rows; the diagnosis weighs both. None where commands are not held from row to row.
    ///
    /// Their [wander](ParameterSpec::wander) is that of the instants from switch to switch.
    fn command_timing(&self) -> Vec<(usize, ParameterSpec)> {
        Vec::new()
    }
    /// Lines of unknown phase that a model leaves in the output of a stage where it is not fitted; see [`Line`].
    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        let _ = (stage, model);
        Vec::new()
    }
    /// The motion by which the gap is cut into regimes, levels and rates: the first stage's output unless said
    /// otherwise.
    fn motion(&self) -> Motion<'_> {
        let unit = self.stages().first().map_or("", |s| s.unit.as_str());
        Motion { values: self.measured(0), unit, falling: "falling", rising: "rising" }
    }
    /// The stage whose output a user turns back into the motion with a calibration; none where there is no such sensor.
    fn sensor(&self) -> Option<usize> {
        None
    }
    /// Share of a channel's variance that may be left before the names of effects mean nothing.
    fn foreign_share(&self) -> f64 {
        0.1
    }
    /// Measured input of a stage as it is fed with it, all trials end to end; none where it is not the output of the
    /// stage before.
    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        let _ = stage;
        None
    }
    /// As [`Simulator::simulate`] on an input that was not measured; says whether the stage can.
    ///
    /// # Errors
    /// When the simulation is not possible with these values.
    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let _ = (run, input, out);
        Ok(false)
    }
}
