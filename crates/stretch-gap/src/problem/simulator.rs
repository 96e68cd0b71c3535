//! The one trait through which any simulator is diagnosed, and what some simulators can do besides.

use std::borrow::Cow;

use rayon::prelude::*;
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

    /// The same model with one effect more.
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
    /// Adds another draw of their noise to the measured inputs, from this seed: shows how much of it arrives at
    /// the output.
    pub input_noise: Option<u64>,
    /// Multiple of the usual step of integration: 0.5 for the check of the solver, 2 where that check allows longer steps.
    pub step: f64,
    /// Nominal parameters so near that the output may be taken from the run there and the [linearisation](Costly::linearise), where a
    /// run costs more than that; none where it has to be exact.
    pub near: Option<&'a [f64]>,
}

impl<'a> Run<'a> {
    /// An exact run on the inputs as they were measured, at the usual step.
    pub fn exact(stage: usize, model: &'a Model, trials: usize) -> Self {
        Self { stage, model, trials, input_noise: None, step: 1.0, near: None }
    }
}

/// Runs of a simulator that are counted, because they cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ModelRuns {
    /// Number of runs that were made.
    pub count: usize,
    /// Number of runs that may be made, where that is limited.
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
/// Three methods do: [`Simulator::description`], [`Simulator::measured`] and [`Simulator::simulate`]. What else a simulator can
/// do it shows as one of the small traits behind the other methods, by returning itself: `Some(self)`.
pub trait Simulator: Sync {
    /// Stages, parameters, effects, trials, and what is known of the record, in one.
    fn description(&self) -> &Description;
    /// Measured output of a stage, all trials end to end.
    fn measured(&self, stage: usize) -> &[f64];
    /// Simulates a stage on its measured input; effects of other stages in the model are passed over.
    ///
    /// `out` takes the samples of the first `run.trials` trials.
    ///
    /// # Errors
    /// When the simulation is not possible with these values: the fit then turns back.
    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError>;
    /// Runs in batches, where a batch costs little more than a run; without it runs go side by side on the threads there are.
    fn batch(&self) -> Option<&dyn Batch> {
        None
    }
    /// How dear runs are, where each costs enough to be counted and spared.
    fn costly(&self) -> Option<&dyn Costly> {
        None
    }
    /// Runs on inputs that were not measured, where a stage can be driven by such.
    fn driven(&self) -> Option<&dyn Driven> {
        None
    }
    /// Lines of unknown phase, where an effect leaves such.
    fn spectral_lines(&self) -> Option<&dyn SpectralLines> {
        None
    }
}

/// A simulator for which a batch of runs costs little more than one run: that is what makes its diagnosis fast.
pub trait Batch {
    /// Some runs at once, each as [`Simulator::simulate`] answers it.
    ///
    /// `outs` takes the samples of each run, and is as long as `runs`.
    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>>;
}

/// Some runs at once, each as [`Simulator::simulate`] answers it: in one batch where the simulator takes batches, else side by side.
pub(crate) fn simulate_many(
    simulator: &dyn Simulator,
    runs: &[Run<'_>],
    outs: &mut [Vec<f64>],
) -> Vec<Result<(), GapError>> {
    match simulator.batch() {
        Some(batch) => batch.simulate_many(runs, outs),
        None => side_by_side(simulator, runs, outs),
    }
}

/// Some runs on the threads there are.
pub(crate) fn side_by_side(
    simulator: &dyn Simulator,
    runs: &[Run<'_>],
    outs: &mut [Vec<f64>],
) -> Vec<Result<(), GapError>> {
    let pairs = runs.par_iter().zip(outs);
    pairs.map(|(run, out)| simulator.simulate(*run, out)).collect()
}

/// A simulator whose runs cost: they are counted, and may be limited.
pub trait Costly {
    /// Runs so far of what is simulated. They are fewer than the simulations of stages where a kept run serves again.
    fn model_runs(&self) -> ModelRuns;
    /// Whether each value of an effect takes a run of its own, so that sensitivities to the effect are renewed as seldom as those to
    /// the nominal parameters.
    fn is_costly(&self, effect: usize) -> bool;
    /// Takes sensitivities of a stage to its nominal parameters around a model: from here on, runs that say what they are
    /// [near to](Run::near) may be answered with them. It is called between searches, never during one, so that the answer does not depend on
    /// the threads. By default every run stays exact.
    ///
    /// # Errors
    /// When the simulation is not possible with these values.
    fn linearise(&self, stage: usize, model: &Model, trials: usize) -> Result<(), GapError> {
        let _ = (stage, model, trials);
        Ok(())
    }
}

/// A simulator of which stages can be driven by something else than what was measured.
pub trait Driven {
    /// Measured input of a stage as the stage is fed with it, all trials end to end; none where the input is not the output of the
    /// stage before.
    fn input(&self, stage: usize) -> Option<Vec<f64>>;
    /// As [`Simulator::simulate`] on an input that was not measured; says whether the stage can.
    ///
    /// # Errors
    /// When the simulation is not possible with these values.
    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError>;
    /// The same simulator driven by a record of which one column is corrected, its error undone; none where that column drives no
    /// stage. What was measured of the stages' outputs may stay as it is.
    ///
    /// # Errors
    /// When the corrected column cannot drive the simulator.
    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError>;
}

/// A simulator with effects that leave a line of known strength and unknown phase in an output.
pub trait SpectralLines {
    /// Lines that a model leaves in the output of a stage where it is not fitted; see [`Line`].
    fn lines(&self, stage: usize, model: &Model) -> Vec<Line>;
}

/// Short ways to what the [description](Simulator::description) of any simulator says.
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
    /// What is known of the record beside the description's lists.
    pub fn record(&self) -> &RecordFacts {
        self.description().record()
    }
    /// The motion by which the gap is cut into regimes, levels and rates: the first stage's output unless the
    /// [record](RecordFacts::motion) has another.
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
