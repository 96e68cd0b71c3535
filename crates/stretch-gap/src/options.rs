//! How to diagnose.

use crate::problem::thresholds::Thresholds;

/// How to diagnose.
#[derive(Debug, Clone)]
pub struct Options {
    /// Most effects named at once.
    pub depth: usize,
    /// Threads; 0 takes all. The result is the same.
    pub threads: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Whether simpler methods are run beside.
    pub baselines: bool,
    /// Whether [answers](crate::Responses) to the numbers of the best set are gathered, for a page where they can be turned.
    pub responses: bool,
    /// Whether [detection limits](crate::DetectionLimit) are found whatever the verdict is; where nothing is named they are found anyway.
    pub detection_limits: bool,
    /// Calibrated numbers.
    pub thresholds: Thresholds,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            depth: 4,
            threads: 0,
            seed: 1,
            baselines: false,
            responses: false,
            detection_limits: false,
            thresholds: Thresholds::frozen(),
        }
    }
}
