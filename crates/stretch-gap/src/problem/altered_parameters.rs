//! A simulator with other tolerances.
//!
//! A held parameter (tolerance 0) stays as shipped: the ablation without re-tuning. A parameter
//! without a tolerance shows whether it could explain what effects are credited with.

use crate::problem::{
    description::Description,
    error::GapError,
    simulator::{Batch, Costly, Driven, Run, Simulator, SpectralLines},
    spec::ParameterSpec,
};

/// A simulator with other descriptions of its parameters: held, or free.
pub(crate) struct Altered<'a> {
    simulator: &'a dyn Simulator,
    about: Description,
}

impl<'a> Altered<'a> {
    /// A simulator in which `altered` maps every parameter, given with its index.
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

    fn batch(&self) -> Option<&dyn Batch> {
        self.simulator.batch()
    }

    fn costly(&self) -> Option<&dyn Costly> {
        self.simulator.costly()
    }

    fn driven(&self) -> Option<&dyn Driven> {
        self.simulator.driven()
    }

    fn spectral_lines(&self) -> Option<&dyn SpectralLines> {
        self.simulator.spectral_lines()
    }
}
