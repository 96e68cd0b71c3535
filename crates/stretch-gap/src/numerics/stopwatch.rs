//! How long it took, where there is a clock.

/// A web page's WASM has no clock of its own, and asking for the time would end it.
const HAS_CLOCK: bool = cfg!(not(all(target_family = "wasm", target_os = "unknown")));

/// When something began.
pub(crate) struct Stopwatch(Option<std::time::Instant>);

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self(HAS_CLOCK.then(std::time::Instant::now))
    }

    /// Seconds since; 0 where there is no clock, for whoever has one to fill in.
    pub(crate) fn elapsed_s(&self) -> f64 {
        self.0.map_or(0.0, |begun| begun.elapsed().as_secs_f64())
    }
}
