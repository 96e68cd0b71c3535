//! Measures elapsed time on targets with a clock.

/// WASM in a web page has no clock, and asking for the time would abort it.
const HAS_CLOCK: bool = cfg!(not(all(target_family = "wasm", target_os = "unknown")));

/// When something began.
pub(crate) struct Stopwatch(Option<std::time::Instant>);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(HAS_CLOCK.then(std::time::Instant::now))
    }

    /// Seconds since the start; 0 on a target without a clock, where the caller can fill it in.
    pub(crate) fn elapsed_s(&self) -> f64 {
        self.0.map_or(0.0, |begun| begun.elapsed().as_secs_f64())
    }
}
