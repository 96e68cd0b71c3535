//! What a run finds that is no function of what was moved: pressures of the chamber, lengths of the muscle.
//!
//! Runs that differ in the muscle alone find the chamber's pressure kept; those that differ in the gauge alone, the pressure and the length
//! that stand in for what was not measured.

use std::num::NonZeroUsize;

use stretch_sim::{ActiveEffect, EffectSet, Grid, PARAMETERS, ParameterInfo, RigParams, Stage};

use crate::bench::kept::Kept;

/// By trial, pressure at every node or sample, kPa.
pub(super) type Pressures = Vec<Vec<f64>>;
/// Effects, and bits of all numbers.
pub(super) type Causes = (Vec<&'static str>, Vec<u64>);

/// What is kept, by what it is a function of.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// Pressures at every node.
    pub(super) nodes: Kept<Causes, Pressures>,
    /// Pressures at every sample: what there is without a pressure column.
    pub(super) samples: Kept<Causes, Pressures>,
    /// Lengths without play in the reference, mm, all trials end to end.
    pub(super) lengths: Kept<Causes, Vec<f64>>,
}

/// Results of each kind that are kept: those of the probes and steps of the fits under way.
const KEPT: NonZeroUsize = NonZeroUsize::new(12).expect("not 0");

impl Found {
    pub(super) fn new() -> Self {
        Self { nodes: Kept::new(KEPT), samples: Kept::new(KEPT), lengths: Kept::new(KEPT) }
    }
}

/// All that what happens in some stages is a function of; `others` are what a run has beside parameters and effects.
pub(super) fn causes(
    stages: &[Stage],
    params: &RigParams,
    effects: &EffectSet,
    grid: &Grid,
    others: impl IntoIterator<Item = f64>,
) -> Causes {
    let acting = || stages.iter().flat_map(|stage| effects.acting_in(*stage));
    let acts = acting().next().is_some();
    // Effects know of the scales around them.
    let counts = |info: &&ParameterInfo| {
        stages.contains(&info.stage) || (acts && info.stage == Stage::Muscle)
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
