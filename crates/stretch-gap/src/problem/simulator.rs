//! The trait through which every simulator is diagnosed.

use std::borrow::Cow;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::problem::{
    column::{Column, Distortion},
    description::Description,
    error::GapError,
    record_facts::{Motion, RecordFacts},
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

    /// The same model with one more effect.
    pub(crate) fn with(&self, effect: usize, values: &[f64]) -> Self {
        let mut model = self.clone();
        model.effects.push((effect, values.to_vec()));
        model
    }
}

/// One run of one stage over the session.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Index of the stage that is run.
    pub stage: usize,
    /// Parameters and effects.
    pub model: &'a Model,
    /// Number of the session's trials that are run, from the first.
    pub trials: usize,
    /// Adds another draw of their noise to the measured inputs, from this seed, to show how much of
    /// it arrives at the output.
    pub input_noise: Option<u64>,
    /// Multiple of the usual step of integration: 0.5 for the check of the solver, 2 if that check
    /// allows longer steps.
    pub step: f64,
    /// Nominal parameters near enough that the output may be computed from the run there and the
    /// [linearisation](Simulator::linearise), if a run costs more than that; `None` if the output has
    /// to be exact.
    pub near: Option<&'a [f64]>,
}

impl<'a> Run<'a> {
    /// An exact run on the measured inputs, at the usual step.
    pub fn exact(stage: usize, model: &'a Model, trials: usize) -> Self {
        Self { stage, model, trials, input_noise: None, step: 1.0, near: None }
    }
}

/// Runs of a costly simulator, which are counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ModelRuns {
    /// Number of runs so far.
    pub count: usize,
    /// Largest number of runs, if it is limited.
    pub budget: Option<usize>,
    /// Whether only the runs that the answer itself needs are left; in a diagnosis, whether the
    /// search was therefore cut short.
    pub is_spent: bool,
}

impl ModelRuns {
    /// A note that the search was cut short, if it was.
    pub(crate) fn note(&self) -> Option<String> {
        let budget = self.budget.filter(|_| self.is_spent)?;
        Some(format!(
            "the budget of {budget} model runs was spent before the search was over ({} were made): the answer is based on what was fitted until then; give more to look further",
            self.count
        ))
    }
}

/// A simulator and the measurements that it is compared with.
///
/// Every stage is run alone on its measured input (teacher forcing), so that the error of one stage
/// does not spread to the next. Memories are carried from trial to trial in the order of the
/// session.
///
/// Three methods suffice: [`Simulator::description`], [`Simulator::measured`] and
/// [`Simulator::simulate`]. The others are abilities of some simulators.
pub trait Simulator: Sync {
    /// Stages, parameters, effects, trials, and facts about the record.
    fn description(&self) -> &Description;

    /// Measured output of a stage, all trials concatenated.
    fn measured(&self, stage: usize) -> &[f64];

    /// Simulates a stage on its measured input; effects of other stages in the model are ignored.
    ///
    /// `out` receives the samples of the first `run.trials` trials.
    ///
    /// # Errors
    /// The simulation is not possible with these values; the fit then rejects the step.
    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError>;

    /// Several runs at once, each with the result of [`Simulator::simulate`]: on the available
    /// threads, unless a batch costs the simulator little more than a run.
    ///
    /// `outs` receives the samples of each run, and is as long as `runs`.
    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        on_all_threads(self, runs, outs)
    }

    /// Runs so far, if each is costly enough to be counted and saved. They are fewer than the
    /// simulations of stages if a stored run is used again.
    fn model_runs(&self) -> Option<ModelRuns> {
        None
    }

    /// Whether each value of an effect needs a separate costly run. Sensitivities to the effect are
    /// then renewed as seldom as those to the nominal parameters.
    fn is_costly(&self, effect: usize) -> bool {
        let _ = effect;
        false
    }

    /// Computes sensitivities of a stage to its nominal parameters around a model. From then on,
    /// runs that state what they are [near to](Run::near) may be answered with them. It is called
    /// between searches, never during one, so that the answer does not depend on the threads. By
    /// default every run stays exact.
    ///
    /// # Errors
    /// The simulation is not possible with these values.
    fn linearise(&self, stage: usize, model: &Model, trials: usize) -> Result<(), GapError> {
        let _ = (stage, model, trials);
        Ok(())
    }

    /// Measured input of a stage as it is fed to the stage, all trials concatenated; `None` if the
    /// input is not the output of the previous stage.
    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        let _ = stage;
        None
    }

    /// As [`Simulator::simulate`] on an unmeasured input; returns whether the stage supports this.
    ///
    /// # Errors
    /// The simulation is not possible with these values.
    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let _ = (run, input, out);
        Ok(false)
    }

    /// The same simulator driven by a record in which the error of one column is corrected; `None`
    /// if that column drives no stage. The measurements of the stages' outputs may stay unchanged.
    ///
    /// # Errors
    /// The corrected column cannot drive the simulator.
    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        let _ = (column, error);
        Ok(None)
    }

    /// Lines of known strength and unknown phase that the effects of a model leave in the output of
    /// a stage on samples that are not fitted; see [`Line`].
    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        let _ = (stage, model);
        Vec::new()
    }
}

/// Several runs on the available threads.
pub(crate) fn on_all_threads<S: Simulator + ?Sized>(
    simulator: &S,
    runs: &[Run<'_>],
    outs: &mut [Vec<f64>],
) -> Vec<Result<(), GapError>> {
    let pairs = runs.par_iter().zip(outs);
    pairs.map(|(run, out)| simulator.simulate(*run, out)).collect()
}

/// Shortcuts to the [description](Simulator::description) of any simulator.
impl dyn Simulator + '_ {
    /// Stages of the simulator.
    pub fn stages(&self) -> &[StageSpec] {
        &self.description().stages
    }
    /// Nominal parameters of the simulator.
    pub fn parameters(&self) -> &[ParameterSpec] {
        &self.description().parameters
    }
    /// The catalogue of effects that the simulator may lack.
    pub fn effects(&self) -> &[EffectSpec] {
        &self.description().effects
    }
    /// The trials, in the order of the session.
    pub fn trials(&self) -> &[TrialSpec] {
        &self.description().trials
    }
    /// Sample time, s, the same in every trial.
    pub fn dt_s(&self) -> f64 {
        self.description().dt_s
    }
    /// What is known of the record in addition to the description's lists.
    pub fn record(&self) -> &RecordFacts {
        self.description().record()
    }
    /// The motion by which the gap is divided into regimes, levels and rates: the first stage's
    /// output unless the [record](RecordFacts::motion) has another.
    pub fn motion(&self) -> Motion<'_> {
        match &self.record().motion {
            Some(motion) => motion.as_ref(),
            None => {
                let unit = self.stages().first().map_or("", |s| s.unit.as_str());
                Motion { values: self.measured(0), unit, falling: "falling", rising: "rising" }
            }
        }
    }
    /// Columns of the record: those of the stages' outputs, unless the [record](RecordFacts::columns) lists more.
    pub fn columns(&self) -> Vec<Column<'_>> {
        let known = &self.record().columns;
        let mut columns: Vec<Column<'_>> = match known.is_empty() {
            true => self.stages().iter().enumerate().map(|(i, s)| Column::output(i, s)).collect(),
            false => known.iter().map(Column::borrowed).collect(),
        };
        for column in &mut columns {
            if let Some(stage) = column.output_of {
                column.values = Cow::Borrowed(self.measured(stage));
            }
        }
        columns
    }
}
