//! By how much samples are late.

/// By how much samples are late.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SkewSpec {
    /// At the trial's start, s.
    pub skew_s: f64,
    /// How much later they get, s/s: two clocks that part.
    pub rate: f64,
    /// Share of the first value that is not there yet before it arrives: 0 where it is held from before, 1 where a line is empty.
    pub empty: f64,
}
