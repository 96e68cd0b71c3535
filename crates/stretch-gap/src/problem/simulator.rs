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

/// A setting of the simulator: values of the nominal parameters and of the active effects.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// Every nominal parameter, in the simulator's order.
    pub parameters: Vec<f64>,
    /// Active effects: index in the catalogue, and values of the effect's parameters.
    pub effects: Vec<(usize, Vec<f64>)>,
}

impl Model {
    /// Returns the simulator's own setting: nominal values and no effects.
    pub fn nominal(simulator: &dyn Simulator) -> Self {
        let parameters = simulator.parameters().iter().map(|p| p.nominal).collect();
        Self { parameters, effects: Vec::new() }
    }

    /// Returns the values of an effect; `None` if it is not active.
    pub fn effect(&self, index: usize) -> Option<&[f64]> {
        self.effects.iter().find(|(i, _)| *i == index).map(|(_, values)| values.as_slice())
    }

    /// Returns the same model with one more effect.
    pub(crate) fn with(&self, effect: usize, values: &[f64]) -> Self {
        let mut model = self.clone();
        model.effects.push((effect, values.to_vec()));
        model
    }
}

/// One run of one stage over the first trials of the session.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// Index of the stage that is run.
    pub stage: usize,
    /// Parameters and effects.
    pub model: &'a Model,
    /// Number of the session's trials that are run, from the first.
    pub trials: usize,
    /// If set, the seed of an additional noise realisation that is added to the measured inputs. It
    /// shows how much input noise reaches the output.
    pub input_noise: Option<u64>,
    /// Factor on the usual integration step: 0.5 for the check of the solver, and 2 if that check
    /// allows longer steps.
    pub step: f64,
    /// Nominal parameters from which the output may be extrapolated by the
    /// [linearisation](Simulator::linearise) around them, if that costs less than a run. `None` if
    /// the output must be exact.
    pub near: Option<&'a [f64]>,
    /// Whether the run may use the last runs of a budget, which are reserved for the answer. The
    /// runs of the search may not.
    pub may_use_reserve: bool,
}

impl<'a> Run<'a> {
    /// Describes an exact run on the measured inputs, with the usual step.
    pub fn exact(stage: usize, model: &'a Model, trials: usize) -> Self {
        Self {
            stage,
            model,
            trials,
            input_noise: None,
            step: 1.0,
            near: None,
            may_use_reserve: true,
        }
    }
}

/// Count of the runs of a simulator whose runs are costly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ModelRuns {
    /// Number of runs so far.
    pub count: usize,
    /// Largest number of runs, if it is limited.
    pub budget: Option<usize>,
    /// Whether only the runs that the answer itself needs are left. In a diagnosis: whether the
    /// search was cut short for this reason.
    pub is_spent: bool,
}

/// A simulator and the measurements that it is compared with.
///
/// Every stage is run alone on its measured input (teacher forcing), so that the error of one stage
/// does not reach the next. Memories (states such as hysteresis) carry over from trial to trial in
/// the order of the session.
///
/// Only [`Simulator::description`], [`Simulator::measured`] and [`Simulator::simulate`] are
/// required. The other methods are optional abilities.
pub trait Simulator: Sync {
    /// Returns stages, parameters, effects, trials, and facts about the recording.
    fn description(&self) -> &Description;

    /// Returns the measured output of a stage, all trials concatenated.
    fn measured(&self, stage: usize) -> &[f64];

    /// Returns the simulator around which this one is a wrapper, if it is one. The optional methods
    /// are then those of that simulator, unless the wrapper overrides them.
    fn wrapped(&self) -> Option<&dyn Simulator> {
        None
    }

    /// Simulates a stage on its measured input. Effects of other stages in the model are ignored.
    ///
    /// `out` receives the samples of the first `run.trials` trials.
    ///
    /// # Errors
    /// The simulation is not possible with these values. The fit then rejects the step.
    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError>;

    /// Simulates several runs; each result is that of [`Simulator::simulate`]. By default the runs
    /// are distributed over the available threads. A simulator for which a batch costs little more
    /// than one run can override this.
    ///
    /// `outs` has one vector for each run, which receives its samples.
    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        match self.wrapped() {
            Some(wrapped) => wrapped.simulate_many(runs, outs),
            None => on_all_threads(self, runs, outs),
        }
    }

    /// Returns the number of runs so far, if each run is costly enough to be counted and stored. If
    /// stored runs are reused, this number is smaller than the number of simulated stages.
    fn model_runs(&self) -> Option<ModelRuns> {
        self.wrapped()?.model_runs()
    }

    /// Whether each value of an effect needs a separate costly run. During a fit, sensitivities to
    /// this effect are then recomputed as rarely as those to the nominal parameters.
    fn is_costly(&self, effect: usize) -> bool {
        self.wrapped().is_some_and(|wrapped| wrapped.is_costly(effect))
    }

    /// Computes the sensitivities of a stage's output to the nominal parameters, at the model of
    /// this run. Later runs that are [near](Run::near) this model may use the sensitivities instead
    /// of a simulation. The diagnosis calls this function between
    /// searches, never during one, so that the answer does not depend on the threads. By default
    /// nothing is computed, and every run is exact.
    ///
    /// # Errors
    /// The simulation is not possible with these values.
    fn linearise(&self, run: Run<'_>) -> Result<(), GapError> {
        self.wrapped().map_or(Ok(()), |wrapped| wrapped.linearise(run))
    }

    /// Returns the measured input of a stage as it is fed to the stage, all trials concatenated.
    /// `None` if the input is not the output of the previous stage.
    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        self.wrapped()?.input(stage)
    }

    /// Simulates a stage on an input that was not measured. Returns false if the stage does not
    /// support this.
    ///
    /// # Errors
    /// The simulation is not possible with these values.
    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        self.wrapped().map_or(Ok(false), |wrapped| wrapped.simulate_on(run, input, out))
    }

    /// Returns the same simulator, with the stages that one column drives run on that column after
    /// its error is corrected. `None` if that column drives no stage. The measured outputs may stay
    /// unchanged.
    ///
    /// # Errors
    /// The corrected column cannot drive the simulator.
    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        self.wrapped().map_or(Ok(None), |wrapped| wrapped.corrected(column, error))
    }

    /// Returns spectral lines of known amplitude and unknown phase that the effects of a model add
    /// to a stage's output on samples that are not fitted; see [`Line`].
    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        self.wrapped().map_or_else(Vec::new, |wrapped| wrapped.lines(stage, model))
    }
}

/// Simulates several runs on the available threads.
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
        &self.description().spec().stages
    }
    /// Nominal parameters of the simulator.
    pub fn parameters(&self) -> &[ParameterSpec] {
        &self.description().spec().parameters
    }
    /// The catalogue of effects that the simulator may lack.
    pub fn effects(&self) -> &[EffectSpec] {
        &self.description().spec().effects
    }
    /// The trials, in the order of the session.
    pub fn trials(&self) -> &[TrialSpec] {
        &self.description().spec().trials
    }
    /// Sample time, s, the same in every trial.
    pub fn dt_s(&self) -> f64 {
        self.description().spec().dt_s
    }
    /// Returns the facts about the recording in addition to the description's lists.
    pub fn record(&self) -> &RecordFacts {
        self.description().record()
    }
    /// Returns the motion by which the gap is divided into regimes, levels and rates: that of the
    /// [record](RecordFacts::motion), or else the output of the first stage.
    pub fn motion(&self) -> Motion<'_> {
        match &self.record().motion {
            Some(motion) => motion.as_ref(),
            None => {
                let unit = self.stages().first().map_or("", |s| s.unit.as_str());
                Motion { values: self.measured(0), unit, falling: "falling", rising: "rising" }
            }
        }
    }
    /// Returns the columns of the recording: those that the [record](RecordFacts::columns) lists,
    /// or else the outputs of the stages.
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
