//! A simulator with other tolerances.
//!
//! Held (tolerance 0), a parameter stays as shipped: the ablation without re-tuning. Set loose, it shows whether it could explain what
//! effects are credited with.

use crate::problem::{
    as_is::as_is,
    description::Description,
    error::GapError,
    simulator::{Model, Run, Simulator},
    spec::ParameterSpec,
    spectral_line::Line,
};

/// A simulator whose parameters are told another way: held, or set loose.
pub(crate) struct Altered<'a> {
    simulator: &'a dyn Simulator,
    about: Description,
}

impl<'a> Altered<'a> {
    /// Every parameter, with its index, as `told`.
    pub(crate) fn of(
        simulator: &'a dyn Simulator,
        told: impl Fn(usize, &ParameterSpec) -> ParameterSpec,
    ) -> Self {
        Self { simulator, about: simulator.description().with_parameters(told) }
    }
}

impl Simulator for Altered<'_> {
    as_is!();

    fn description(&self) -> &Description {
        &self.about
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        self.simulator.lines(stage, model)
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        self.simulator.simulate_on(run, input, out)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        self.simulator.simulate(run, out)
    }

    fn simulate_many(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        self.simulator.simulate_many(runs, outs)
    }
}
