//! Measures elapsed time on targets with a clock.

/// Whether the target has a clock. WASM in a web page has none, and reading the time would abort
/// it.
const HAS_CLOCK: bool = cfg!(not(all(target_family = "wasm", target_os = "unknown")));

/// The time when a measurement began.
pub(crate) struct Stopwatch(Option<std::time::Instant>);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(HAS_CLOCK.then(std::time::Instant::now))
    }

    /// Returns the seconds since the start; 0 on a target without a clock, where the caller may
    /// fill in the time.
    pub(crate) fn elapsed_s(&self) -> f64 {
        self.0.map_or(0.0, |begun| begun.elapsed().as_secs_f64())
    }
}
