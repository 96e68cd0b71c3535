//! The one trait through which any simulator is diagnosed.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::problem::{
    column::{Column, Distortion},
    description::Description,
    error::GapError,
    rows_used::RowsUsed,
    spec::{EffectSpec, ParameterSpec, StageSpec, TrialSpec},
    spectral_line::Line,
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
    /// Multiple of the usual step of integration: 0.5 for the check of the solver, 2 where that check allows longer steps.
    pub step: f64,
    /// Nominal parameters so near that the output may be told from the run there and the [linearisation](Simulator::linearise), where a
    /// run costs more than that; none where it has to be exact.
    pub near: Option<&'a [f64]>,
}

impl<'a> Run<'a> {
    /// An exact run on the inputs as they were measured, at the usual step.
    pub fn exact(stage: usize, model: &'a Model, trials: usize) -> Self {
        Self { stage, model, trials, shake: None, step: 1.0, near: None }
    }
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

/// A signal that was recorded beside the outputs, or is fed to a stage: what a missing term may be a function of.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Column.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Values, all trials end to end; a measured one smoothed as far as its noise allows, for terms use its rate.
    pub values: Vec<f64>,
    /// Whether it is commanded: it may jump, and its zero means that nothing is done.
    pub is_command: bool,
}

impl Recorded {
    /// A signal that is no command.
    pub fn measured(name: &str, unit: &str, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), values, is_command: false }
    }
}

impl From<Motion<'_>> for Recorded {
    /// The motion, where nothing else was recorded.
    fn from(motion: Motion<'_>) -> Self {
        Self::measured("motion", motion.unit, motion.values.to_vec())
    }
}

/// Runs of a simulator that are counted, because they cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelRuns {
    /// How many were made.
    pub count: usize,
    /// How many may be made, where that is limited.
    pub budget: Option<usize>,
    /// Whether no more may be made but those that the answer itself needs; in a diagnosis, whether the search was cut short for it.
    pub is_spent: bool,
}

impl ModelRuns {
    /// That the search was cut short, where it was.
    pub(crate) fn note(&self) -> Option<String> {
        let budget = self.budget.filter(|_| self.is_spent)?;
        Some(format!(
            "the budget of {budget} model runs was spent before the search was over ({} were made): the answer stands on what was fitted until then; give more to look further",
            self.count
        ))
    }
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
    /// Samples of all trials end to end that were not measured, whatever stands in their place: they count for nothing. Empty
    /// where all were.
    fn is_lost(&self) -> &[bool] {
        &[]
    }
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
    /// Some runs at once, each as [`Simulator::simulate`] answers it: by default side by side on the threads there are. Where a batch
    /// costs little more than a run, this is what makes a diagnosis fast.
    ///
    /// `outs` takes the samples of each run, and is as long as `runs`.
    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        let pairs = runs.par_iter().zip(outs);
        pairs.map(|(run, out)| self.simulate(*run, out)).collect()
    }
    /// Takes sensitivities of a stage to its nominal parameters around a model: from here on runs that may be told
    /// [from near by](Run::near) are told with them. Does nothing where every run is exact. It is called between searches, never while
    /// one goes on, so that the answer does not depend on the threads.
    ///
    /// # Errors
    /// When the simulation is not possible with these values.
    fn linearise(&self, stage: usize, model: &Model, trials: usize) -> Result<(), GapError> {
        let _ = (stage, model, trials);
        Ok(())
    }
    /// Whether each value of an effect is a run of something that costs, so that its sensitivities are renewed as seldom as those of the
    /// nominal parameters.
    fn is_costly(&self, effect: usize) -> bool {
        let _ = effect;
        false
    }
    /// Runs of what is simulated, where that is not as many as simulations of stages: a black box is not run anew for what stands behind it.
    fn model_runs(&self) -> Option<ModelRuns> {
        None
    }
    /// Rows that the trials stand on, of those that were read; all, where it reads none.
    fn rows_used(&self) -> RowsUsed {
        let used = self.trials().iter().map(|t| t.samples).sum();
        RowsUsed { used, read: used }
    }
    /// Parameters that are exact while commands switch at rows of the record, and what they are where commands switch anywhere
    /// between two rows; the diagnosis weighs both. None where commands are not held from row to row.
    ///
    /// What differs from switch to switch is told [by tick](ParameterSpec::per_tick_sd).
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
    /// Everything that a missing term may be a function of: by default what the stages are fed with, under the name of the
    /// channel before, or the motion where they are fed with nothing.
    fn recorded(&self) -> Vec<Recorded> {
        let fed = (1..self.stages().len()).filter_map(|stage| {
            let before = &self.stages()[stage - 1];
            Some(Recorded::measured(&before.channel, &before.unit, self.input(stage)?))
        });
        let fed: Vec<Recorded> = fed.collect();
        let motion = self.motion();
        match fed.is_empty() {
            true => vec![motion.into()],
            false => fed,
        }
    }
    /// As [`Simulator::simulate`] on an input that was not measured; says whether the stage can.
    ///
    /// # Errors
    /// When the simulation is not possible with these values.
    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let _ = (run, input, out);
        Ok(false)
    }
    /// Columns of the record: those of the stages' outputs, unless more are known.
    fn columns(&self) -> Vec<Column<'_>> {
        let stages = self.stages().iter().enumerate();
        stages.map(|(i, spec)| Column::output(i, spec, self.measured(i))).collect()
    }
    /// The same simulator driven by one column of the record put right; none where no stage is driven by it.
    ///
    /// What was measured of the stages' outputs may stay as it is.
    ///
    /// # Errors
    /// When the column so put right cannot drive it.
    fn put_right(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        let _ = (column, error);
        Ok(None)
    }
}
