//! A simulator with other tolerances of its parameters, or one whose recording or rig file may be
//! wrong.
//!
//! A tolerance of 0 holds a parameter at its nominal value; this shows what a diagnosis without
//! re-tuning would find. A very wide tolerance shows whether the parameter alone could explain the
//! part of the gap that is attributed to effects.
//!
//! An error is treated as an effect, so that it is fitted together with the nominal parameters. The
//! recorded values do not change. Instead, the supposed error of a column is applied to the
//! simulated output that is compared with it. A stage that has the column as an input is run on a
//! copy of the column from which the error is removed. Every hypothesis is therefore compared with
//! the same measurements.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use crate::problem::{
    column::Column,
    description::Description,
    error::GapError,
    fault::{Fault, Kind},
    simulator::{Model, Run, Simulator, on_all_threads},
    spec::{ParameterSpec, TrialSpec},
    spectral_line::Line,
};

/// Number of cached simulators with a corrected column, enough for the steps of the current fits.
const KEPT: usize = 8;

type Corrected<'a> = Arc<dyn Simulator + Send + 'a>;

/// A simulator with other specifications of its parameters, or with the possible errors of its
/// recording added to its effects.
pub(crate) struct Altered<'a> {
    simulator: &'a dyn Simulator,
    about: Description,
    pub(crate) columns: Vec<Column<'a>>,
    pub(crate) faults: Vec<Fault>,
    /// Simulators driven by a corrected column, by the index of the error and the bits of its size;
    /// `None` if the column drives no stage.
    corrected: Mutex<BTreeMap<(usize, u64), Option<Corrected<'a>>>>,
}

impl<'a> Altered<'a> {
    /// Replaces the specification of every parameter. `altered` returns the new one, given the
    /// index and the old one.
    pub(crate) fn of(
        simulator: &'a dyn Simulator,
        altered: impl Fn(usize, &ParameterSpec) -> ParameterSpec,
    ) -> Self {
        let about = simulator.description().with_parameters(altered);
        let (columns, faults, corrected) = Default::default();
        Self { simulator, about, columns, faults, corrected }
    }

    /// Adds every possible error of the recording and of the rig file to the effects.
    pub(crate) fn with_errors(simulator: &'a dyn Simulator) -> Self {
        let columns = simulator.columns();
        let faults = Fault::all(simulator, &columns);
        let specs = faults.iter().map(|fault| fault.spec.clone());
        let about = simulator.description().with_effects(specs);
        Self { simulator, about, columns, faults, corrected: Mutex::default() }
    }

    /// Returns the index of an error among the effects; the effects of the catalogue precede it.
    pub(crate) fn index(&self, fault: usize) -> usize {
        self.simulator.effects().len() + fault
    }

    /// Returns the error of a model with its size; `None` if the model has no error.
    pub(crate) fn error_of(&self, model: &Model) -> Option<(&Fault, f64)> {
        self.parts(model).1.map(|(fault, size)| (&self.faults[fault], size))
    }

    /// Returns the model without its error, as the simulator itself understands it, and the index
    /// and the size of the error.
    fn parts(&self, model: &Model) -> (Model, Option<(usize, f64)>) {
        let mut model = model.clone();
        let at = model.effects.iter().position(|(e, _)| *e >= self.index(0));
        let error = at.map(|at| model.effects.remove(at));
        (model, error.map(|(e, values)| (e - self.index(0), values[0])))
    }

    /// Returns the simulator driven by the corrected column, from the cache if possible.
    fn corrected_by(&self, fault: usize, size: f64) -> Result<Option<Corrected<'a>>, GapError> {
        let key = (fault, size.to_bits());
        // A poisoned lock can be ignored, because the entries of the cache can be computed again.
        let lock = || self.corrected.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(driven) = lock().get(&key) {
            return Ok(driven.clone());
        }
        let one = &self.faults[fault];
        let column = one.column.map(|c| &self.columns[c]).filter(|c| !c.read_by.is_empty());
        let made = match column {
            Some(column) => self.simulator.corrected(&column.name, one.distortion(size))?,
            None => None,
        };
        let made = made.map(Corrected::from);
        let mut kept = lock();
        if kept.len() >= KEPT {
            kept.clear();
        }
        kept.insert(key, made.clone());
        Ok(made)
    }
}

impl Simulator for Altered<'_> {
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
        let (mut model, error) = self.parts(run.model);
        let Some((fault, size)) = error else { return self.simulator.simulate(run, out) };
        let one = &self.faults[fault];
        if let Kind::Parameter(p) = one.kind {
            model.parameters[p] *= size;
            return self.simulator.simulate(Run { model: &model, near: None, ..run }, out);
        }
        let column = one.column.map(|c| &self.columns[c]);
        let run = Run { model: &model, ..run };
        let is_driven = column.is_some_and(|c| c.read_by.contains(&run.stage));
        match self.corrected_by(fault, size)?.filter(|_| is_driven) {
            Some(driven) => driven.simulate(run, out)?,
            None => self.simulator.simulate(run, out)?,
        }
        if column.is_some_and(|c| c.output_of == Some(run.stage)) {
            for trial in TrialSpec::ranges(&self.about.spec().trials[..run.trials]) {
                let distorted =
                    one.distortion(size).distorted(&out[trial.clone()], self.about.spec().dt_s);
                out[trial].copy_from_slice(&distorted);
            }
        }
        Ok(())
    }

    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        match runs.iter().all(|run| self.error_of(run.model).is_none()) {
            true => self.simulator.simulate_many(runs, outs),
            false => on_all_threads(self, runs, outs),
        }
    }

    fn is_costly(&self, effect: usize) -> bool {
        // Each value of an error needs a run of the simulator.
        let is_error = effect >= self.index(0);
        is_error && self.model_runs().is_some() || self.simulator.is_costly(effect)
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        self.simulator.simulate_on(Run { model: &self.parts(run.model).0, ..run }, input, out)
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        self.simulator.lines(stage, &self.parts(model).0)
    }
}
