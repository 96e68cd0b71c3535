//! Options of a diagnosis.

use std::num::NonZeroUsize;

use crate::problem::thresholds::Thresholds;

/// Options of a diagnosis.
#[derive(Debug, Clone)]
pub struct Options {
    /// Whether missing effects are searched for; without a search the gap is measured, and nothing is named.
    pub examines_effects: bool,
    /// Largest number of effects named at once.
    pub depth: NonZeroUsize,
    /// Number of threads; 0 uses all. The result does not depend on it.
    pub threads: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Whether simpler methods are also run, for comparison.
    pub baselines: bool,
    /// Whether [responses](crate::Responses) to the parameters of the best set are gathered, for a
    /// page where they can be varied.
    pub responses: bool,
    /// Whether [detection limits](crate::DetectionLimit) are computed whatever the verdict is. If
    /// nothing is named they are always computed.
    pub detection_limits: bool,
    /// Calibrated numbers.
    pub thresholds: Thresholds,
}

/// Largest number of effects named at once if nothing is said.
const DEPTH: NonZeroUsize = NonZeroUsize::MIN.saturating_add(3);

impl Default for Options {
    fn default() -> Self {
        Self {
            examines_effects: true,
            depth: DEPTH,
            threads: 0,
            seed: 1,
            baselines: false,
            responses: false,
            detection_limits: false,
            thresholds: Thresholds::frozen(),
        }
    }
}
