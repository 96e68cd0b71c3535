//! A simulator whose parameters have other tolerances.
//!
//! A tolerance of 0 holds a parameter at its nominal value; this shows what a diagnosis without
//! re-tuning would find. A very wide tolerance shows whether the parameter alone could explain the
//! part of the gap that is attributed to effects.

use crate::problem::{
    description::Description,
    error::GapError,
    simulator::{Run, Simulator},
    spec::ParameterSpec,
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

    fn wrapped(&self) -> Option<&dyn Simulator> {
        Some(self.simulator)
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.simulator.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        self.simulator.simulate(run, out)
    }
}
