//! A simulator beside a record, or a rig file, that may be wrong.
//!
//! An error is an effect like any other, so that one fit moves it and the nominal parameters together. What was recorded stays what it
//! is: an output is distorted as the column would be, and a stage that a column drives is driven by the column put right. So every
//! hypothesis is held against the same numbers.

use std::{collections::VecDeque, sync::Mutex};

use rayon::prelude::*;

use crate::{
    problem::{
        as_is::as_is,
        column::Column,
        description::Description,
        error::GapError,
        simulator::{Model, Run, Simulator},
        spectral_line::Line,
    },
    record::fault::{Fault, Kind},
};

/// Simulators with a column put right that are kept: those of the probes and steps of the fits under way.
const KEPT: usize = 8;

type Driven<'a> = std::sync::Arc<dyn Simulator + Send + 'a>;

/// Which error, how large (bits), and the simulator driven by the column put right; none where nothing is driven by it.
type Entry<'a> = (usize, u64, Option<Driven<'a>>);

/// The simulator with its possible errors in the place of the effects.
pub(crate) struct Suspect<'a> {
    simulator: &'a dyn Simulator,
    about: Description,
    columns: Vec<Column<'a>>,
    faults: Vec<Fault>,
    driven: Mutex<VecDeque<Entry<'a>>>,
    /// Index of the first error: effects of the catalogue come before.
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
            driven: Mutex::default(),
        }
    }

    pub(crate) fn columns(&self) -> &[Column<'a>] {
        &self.columns
    }

    pub(crate) fn faults(&self) -> &[Fault] {
        &self.faults
    }

    /// Index of an error among the effects.
    pub(crate) fn index(&self, fault: usize) -> usize {
        self.first + fault
    }

    /// The error of a model, with its size.
    pub(crate) fn error_of(&self, model: &Model) -> Option<(&Fault, f64)> {
        let (index, values) = model.effects.iter().find(|(e, _)| *e >= self.first)?;
        Some((self.faults.get(index - self.first)?, *values.first()?))
    }

    /// A model of the simulator itself.
    fn without_errors(&self, model: &Model) -> Model {
        let mut model = model.clone();
        model.effects.retain(|(e, _)| *e < self.first);
        model
    }

    /// The simulator driven by a column put right.
    fn driven(&self, fault: usize, size: f64) -> Result<Option<Driven<'a>>, GapError> {
        let key = (fault, size.to_bits());
        let found = |kept: &VecDeque<Entry<'a>>| {
            kept.iter().find(|(f, s, _)| (*f, *s) == key).map(|(_, _, driven)| driven.clone())
        };
        // A poisoned list is only a list of what can be made again.
        let lock = || self.driven.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(driven) = found(&lock()) {
            return Ok(driven);
        }
        let one = &self.faults[fault];
        let column = one.column.map(|c| &self.columns[c]).filter(|c| !c.read_by.is_empty());
        let made = match column {
            None => None,
            Some(column) => {
                self.simulator.put_right(&column.name, one.distortion(size))?.map(Driven::from)
            }
        };
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
    as_is!();

    fn description(&self) -> &Description {
        &self.about
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        self.simulator.lines(stage, &self.without_errors(model))
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        let model = self.without_errors(run.model);
        self.simulator.simulate_on(Run { model: &model, ..run }, input, out)
    }

    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        match runs.iter().all(|run| run.model.effects.iter().all(|(e, _)| *e < self.first)) {
            true => self.simulator.simulate_many(runs, outs),
            false => {
                let pairs = runs.par_iter().zip(outs);
                pairs.map(|(run, out)| self.simulate(*run, out)).collect()
            }
        }
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
        match self.driven(index - self.first, size)?.filter(|_| is_driven) {
            Some(driven) => driven.simulate(run, out)?,
            None => self.simulator.simulate(run, out)?,
        }
        if column.is_some_and(|c| c.output_of == Some(run.stage)) {
            self.distorted(fault, size, run.trials, out);
        }
        Ok(())
    }
}
