//! By how much samples are late.

/// By how much samples are late.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SkewSpec {
    /// At the trial's start, s.
    pub skew_s: f64,
    /// How much later they get, s/s: two clocks that part.
    pub rate: f64,
}
