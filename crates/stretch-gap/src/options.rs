//! Options of a diagnosis.

use std::{env, num::NonZeroUsize, thread};

use crate::problem::thresholds::Thresholds;

/// Options of a diagnosis.
#[derive(Debug, Clone)]
pub struct Options {
    /// Whether missing effects are searched for. Without a search the gap is measured, but no
    /// effect is named.
    pub examines_effects: bool,
    /// Largest number of effects named at once.
    pub depth: NonZeroUsize,
    /// Requested number of threads; see [`threads`]. 0 uses all cores. The result does not depend
    /// on this number.
    pub threads: usize,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Whether [responses](crate::Responses) to the parameters of the best set of effects are
    /// computed. A report page needs them to let a reader vary these parameters.
    pub responses: bool,
    /// Whether [detection limits](crate::DetectionLimit) are computed for every verdict. If no
    /// effect is named, they are always computed.
    pub detection_limits: bool,
    /// Calibrated thresholds of the decisions.
    pub thresholds: Thresholds,
}

/// Default of `Options::depth`.
const DEPTH: NonZeroUsize = NonZeroUsize::MIN.saturating_add(3);

impl Default for Options {
    fn default() -> Self {
        Self {
            examines_effects: true,
            depth: DEPTH,
            threads: 0,
            seed: 1,
            responses: false,
            detection_limits: false,
            thresholds: Thresholds::frozen(),
        }
    }
}

/// Environment variable that sets the number of threads if the caller requests none.
const VARIABLE: &str = "RAYON_NUM_THREADS";

/// Returns the number of threads to start if `asked` threads are requested: at most one per core.
/// If `asked` is 0, the number in `RAYON_NUM_THREADS` is used, or else one per core.
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

/// Returns the number in the environment variable; `None` if it is not set, not a number, or 0.
fn said() -> Option<usize> {
    env::var(VARIABLE).ok()?.parse().ok().filter(|said| *said > 0)
}

/// Limits the global thread pool of rayon to one thread per core if `RAYON_NUM_THREADS` asks for
/// more. A program calls this once at its start.
pub fn cap_threads() {
    if said().is_some_and(|said| said > cores()) {
        // If the pool was already started, its size does not change.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads(0)).build_global();
    }
}
