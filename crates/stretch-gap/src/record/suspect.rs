//! A simulator whose recording or rig file may be wrong.
//!
//! An error is treated as an effect, so that it is fitted together with the nominal parameters. The
//! recorded values do not change. Instead, the supposed error of a column is applied to the
//! simulated output that is compared with it. A stage that has the column as an input is run on a
//! copy of the column from which the error is removed. Every hypothesis is therefore compared with
//! the same measurements.

use std::{collections::VecDeque, sync::Mutex};

use crate::{
    problem::{
        column::Column,
        description::Description,
        error::GapError,
        simulator::{Model, Run, Simulator, on_all_threads},
        spectral_line::Line,
    },
    record::fault::{Fault, Kind},
};

/// Number of cached simulators with a corrected column, enough for the steps of the current fits.
const KEPT: usize = 8;

type Corrected<'a> = std::sync::Arc<dyn Simulator + Send + 'a>;

/// Index of the error, bits of its size, and the simulator driven by the corrected column; `None`
/// if the column drives no stage.
type Entry<'a> = (usize, u64, Option<Corrected<'a>>);

/// The simulator, with its possible errors added to its effects.
pub(crate) struct Suspect<'a> {
    simulator: &'a dyn Simulator,
    about: Description,
    columns: Vec<Column<'a>>,
    faults: Vec<Fault>,
    corrected: Mutex<VecDeque<Entry<'a>>>,
    /// Index of the first error among the effects; the effects of the catalogue precede it.
    first: usize,
}

impl<'a> Suspect<'a> {
    pub(crate) fn of(simulator: &'a dyn Simulator) -> Self {
        let columns = simulator.columns();
        let faults = Fault::all(simulator, &columns);
        let specs = faults.iter().map(Fault::spec);
        Self {
            about: simulator.description().with_effects(specs),
            first: simulator.effects().len(),
            simulator,
            columns,
            faults,
            corrected: Mutex::default(),
        }
    }

    pub(crate) fn columns(&self) -> &[Column<'a>] {
        &self.columns
    }

    pub(crate) fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Returns the index of an error among the effects.
    pub(crate) fn index(&self, fault: usize) -> usize {
        self.first + fault
    }

    /// Returns the error of a model with its size; `None` if the model has no error.
    pub(crate) fn error_of(&self, model: &Model) -> Option<(&Fault, f64)> {
        let (index, values) = model.effects.iter().find(|(e, _)| *e >= self.first)?;
        Some((self.faults.get(index - self.first)?, *values.first()?))
    }

    /// Returns the model without errors, as the simulator itself understands it.
    fn without_errors(&self, model: &Model) -> Model {
        let mut model = model.clone();
        model.effects.retain(|(e, _)| *e < self.first);
        model
    }

    /// Returns the simulator driven by the corrected column, from the cache if possible.
    fn corrected_by(&self, fault: usize, size: f64) -> Result<Option<Corrected<'a>>, GapError> {
        let key = (fault, size.to_bits());
        let found = |kept: &VecDeque<Entry<'a>>| {
            kept.iter().find(|(f, s, _)| (*f, *s) == key).map(|(_, _, driven)| driven.clone())
        };
        // A poisoned lock can be ignored, because the entries of the cache can be computed again.
        let lock = || self.corrected.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(driven) = found(&lock()) {
            return Ok(driven);
        }
        let one = &self.faults[fault];
        let column = one.column.map(|c| &self.columns[c]).filter(|c| !c.read_by.is_empty());
        let made = match column {
            Some(column) => self.simulator.corrected(&column.name, one.distortion(size))?,
            None => None,
        };
        let made = made.map(Corrected::from);
        let mut kept = lock();
        kept.push_back((key.0, key.1, made.clone()));
        if kept.len() > KEPT {
            kept.pop_front();
        }
        Ok(made)
    }

    fn distorted(&self, fault: &Fault, size: f64, trials: usize, out: &mut [f64]) {
        let error = fault.distortion(size);
        let mut from = 0;
        for trial in &self.about.trials[..trials] {
            let own = &mut out[from..from + trial.samples];
            own.copy_from_slice(&error.distorted(own, self.about.dt_s));
            from += trial.samples;
        }
    }
}

impl Simulator for Suspect<'_> {
    fn description(&self) -> &Description {
        &self.about
    }

    fn wrapped(&self) -> Option<&dyn Simulator> {
        Some(self.simulator)
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.simulator.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        let mut model = run.model.clone();
        let at = model.effects.iter().position(|(e, _)| *e >= self.first);
        let Some((index, values)) = at.map(|at| model.effects.remove(at)) else {
            return self.simulator.simulate(run, out);
        };
        let (fault, size) = (&self.faults[index - self.first], values[0]);
        if let Kind::Parameter(p) = fault.kind {
            model.parameters[p] *= 1.0 + size;
            return self.simulator.simulate(Run { model: &model, near: None, ..run }, out);
        }
        let column = fault.column.map(|c| &self.columns[c]);
        let run = Run { model: &model, ..run };
        let is_driven = column.is_some_and(|c| c.read_by.contains(&run.stage));
        match self.corrected_by(index - self.first, size)?.filter(|_| is_driven) {
            Some(driven) => driven.simulate(run, out)?,
            None => self.simulator.simulate(run, out)?,
        }
        if column.is_some_and(|c| c.output_of == Some(run.stage)) {
            self.distorted(fault, size, run.trials, out);
        }
        Ok(())
    }

    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        match runs.iter().all(|run| run.model.effects.iter().all(|(e, _)| *e < self.first)) {
            true => self.simulator.simulate_many(runs, outs),
            false => on_all_threads(self, runs, outs),
        }
    }

    fn is_costly(&self, effect: usize) -> bool {
        // Each value of an error needs a run of the simulator.
        let is_error = effect >= self.first;
        is_error && self.model_runs().is_some() || self.simulator.is_costly(effect)
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let model = self.without_errors(run.model);
        self.simulator.simulate_on(Run { model: &model, ..run }, input, out)
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        self.simulator.lines(stage, &self.without_errors(model))
    }
}
