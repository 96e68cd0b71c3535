//! A simulator whose parameters have other tolerances.
//!
//! A tolerance of 0 holds a parameter at its nominal value; this shows what a diagnosis without
//! re-tuning would find. A very wide tolerance shows whether the parameter alone could explain the
//! part of the gap that is attributed to effects.

use crate::problem::{
    column::Distortion,
    description::Description,
    error::GapError,
    simulator::{Model, ModelRuns, Run, Simulator},
    spec::ParameterSpec,
    spectral_line::Line,
};

/// A simulator with other specifications of its parameters.
pub(crate) struct Altered<'a> {
    simulator: &'a dyn Simulator,
    about: Description,
}

impl<'a> Altered<'a> {
    /// Replaces the specification of every parameter by what `altered` returns for its index and
    /// specification.
    pub(crate) fn of(
        simulator: &'a dyn Simulator,
        altered: impl Fn(usize, &ParameterSpec) -> ParameterSpec,
    ) -> Self {
        Self { simulator, about: simulator.description().with_parameters(altered) }
    }
}

impl Simulator for Altered<'_> {
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.simulator.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        self.simulator.simulate(run, out)
    }

    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        self.simulator.simulate_many(runs, outs)
    }

    fn model_runs(&self) -> Option<ModelRuns> {
        self.simulator.model_runs()
    }

    fn is_costly(&self, effect: usize) -> bool {
        self.simulator.is_costly(effect)
    }

    fn linearise(&self, run: Run<'_>) -> Result<(), GapError> {
        self.simulator.linearise(run)
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        self.simulator.input(stage)
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        self.simulator.simulate_on(run, input, out)
    }

    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        self.simulator.corrected(column, error)
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        self.simulator.lines(stage, model)
    }
}
