//! Options of a diagnosis.

use std::{env, num::NonZeroUsize, thread};

use crate::problem::thresholds::Thresholds;

/// Options of a diagnosis.
#[derive(Debug, Clone)]
pub struct Options {
    /// Whether missing effects are searched for; without a search the gap is measured, and nothing is named.
    pub examines_effects: bool,
    /// Largest number of effects named at once.
    pub depth: NonZeroUsize,
    /// Number of threads, as [`threads`] counts them: 0 uses all cores, and no more than these are used. The result does not depend on it.
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

/// The variable of the environment that says how many threads there are if no number is asked for.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// How many threads are started where so many are asked for: at most one a core. Where 0 are asked for it is what `RAYON_NUM_THREADS` says,
/// or one a core.
///
/// ```
/// let cores = std::thread::available_parallelism().map_or(1, usize::from);
/// assert_eq!([0, 1, cores + 1, usize::MAX].map(stretch_gap::threads)[1..], [1, cores, cores]);
/// ```
pub fn threads(asked: usize) -> usize {
    let asked = if asked == 0 { said().unwrap_or(usize::MAX) } else { asked };
    asked.min(cores())
}

fn cores() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// What the variable says.
fn said() -> Option<usize> {
    env::var(VARIABLE).ok()?.parse().ok().filter(|said| *said > 0)
}

/// Caps the threads that all else shares, where `RAYON_NUM_THREADS` asks for more than there are cores. A program calls it once at its begin.
pub fn cap_threads() {
    if said().is_some_and(|said| said > cores()) {
        // if threads were started already, their number stays what it is
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads(0)).build_global();
    }
}
