//! Intermediate results that several runs share: pressures of the chamber, lengths of the muscle.
//!
//! Runs that differ in the muscle alone share the chamber's pressure. Runs that differ in the gauge alone share the simulated pressure and
//! length that stand in for channels without a measurement.

use std::num::NonZeroUsize;

use stretch_sim::{ActiveEffect, EffectSet, Grid, PARAMETERS, ParameterInfo, RigParams, RigStage};

use crate::bench::kept::Kept;

/// Pressure at every node or sample, kPa, by trial.
pub(super) type Pressures = Vec<Vec<f64>>;
/// Names of effects, and the bits of all numbers.
pub(super) type Causes = (Vec<&'static str>, Vec<u64>);

/// Intermediate results, by the causes that they depend on.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// Pressures at every node.
    pub(super) nodes: Kept<Causes, Pressures>,
    /// Simulated pressures at every sample, for recordings without a pressure column.
    pub(super) samples: Kept<Causes, Pressures>,
    /// Lengths without play in the reference, mm, all trials end to end.
    pub(super) lengths: Kept<Causes, Vec<f64>>,
}

/// Number of results of each kind that are kept: enough for the probes and steps of the fits under way.
const KEPT: NonZeroUsize = NonZeroUsize::new(12).expect("not 0");

impl Found {
    pub(super) fn new() -> Self {
        Self { nodes: Kept::new(KEPT), samples: Kept::new(KEPT), lengths: Kept::new(KEPT) }
    }
}

/// Everything that the outputs of some stages depend on; `others` are the numbers of a run beside parameters and effects.
pub(super) fn causes(
    stages: &[RigStage],
    params: &RigParams,
    effects: &EffectSet,
    grid: &Grid,
    others: impl IntoIterator<Item = f64>,
) -> Causes {
    let acting = || stages.iter().flat_map(|stage| effects.acting_in(*stage));
    let acts = acting().next().is_some();
    // An effect may depend on the scales of the muscle.
    let counts = |info: &&ParameterInfo| {
        stages.contains(&info.stage) || (acts && info.stage == RigStage::Muscle)
    };
    let numbers = PARAMETERS
        .iter()
        .filter(counts)
        .map(|info| params[info.key])
        .chain(acting().flat_map(|e| e.values().iter().copied()))
        .chain(grid.steps().iter().copied())
        .chain(others)
        .map(f64::to_bits);
    (acting().map(ActiveEffect::name).collect(), numbers.collect())
}
