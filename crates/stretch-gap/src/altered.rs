//! A simulator with other tolerances.
//!
//! Held (tolerance 0), a parameter stays as shipped: the ablation without re-tuning. Set loose, it shows whether it could explain what
//! effects are credited with.

use crate::{
    description::Description,
    error::GapError,
    simulator::{Motion, Run, Simulator},
    spec::ParameterSpec,
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
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.simulator.measured(stage)
    }

    fn is_lost(&self) -> &[bool] {
        self.simulator.is_lost()
    }

    fn motion(&self) -> Motion<'_> {
        self.simulator.motion()
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        self.simulator.simulate(run, out)
    }
}
