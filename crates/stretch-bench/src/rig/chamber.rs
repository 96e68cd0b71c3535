//! What the chamber's pressure is a function of, where it is simulated: runs that differ in the muscle alone find it kept.

use std::num::NonZeroUsize;

use stretch_sim::{ActiveEffect, EffectSet, Grid, PARAMETERS, ParameterInfo, RigParams, Stage};

use super::timing::Leads;
use crate::kept::Kept;

/// By trial, pressure at every node, kPa.
pub(super) type Pressures = Vec<Vec<f64>>;
/// Effects, and bits of all numbers.
pub(super) type Causes = (Vec<&'static str>, Vec<u64>);

/// Pressures that are kept, by what they are a function of.
pub(super) type Chambers = Kept<Causes, Pressures>;

/// Chambers that are kept: those of the probes and steps of the fits under way.
pub(super) const CHAMBERS: NonZeroUsize = NonZeroUsize::new(12).expect("not 0");

/// All that the pressure of a chamber is a function of which does not depend on the muscle; pressures at the trials' starts in kPa.
pub(super) fn causes(
    params: &RigParams,
    effects: &EffectSet,
    grid: &Grid,
    leads: Leads,
    initial_kpa: &[f64],
) -> Causes {
    let acting = || effects.acting_in(Stage::Pneumatics);
    let acts = acting().next().is_some();
    // Effects know of the scales around them.
    let counts = |info: &&ParameterInfo| {
        info.stage == Stage::Pneumatics || (acts && info.stage == Stage::Muscle)
    };
    let numbers = PARAMETERS
        .iter()
        .filter(counts)
        .map(|info| params[info.key])
        .chain(acting().flat_map(|e| e.values().iter().copied()))
        .chain(initial_kpa.iter().copied())
        .chain(leads)
        .chain(grid.steps().iter().copied())
        .map(f64::to_bits);
    (acting().map(ActiveEffect::name).collect(), numbers.collect())
}
