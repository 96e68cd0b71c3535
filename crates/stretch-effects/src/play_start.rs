//! Where a play begins a trial.

use stretch_core::play;

use crate::operator::Start;

/// Where a play of half-width `w` begins a trial at input `first`; `last` is its output before.
pub(crate) fn play_start(start: Start, last: f64, first: f64, w: f64) -> f64 {
    match start {
        Start::Settled => first,
        Start::Carried { .. } => play(last, first, w),
        Start::Hysteresis(share) => first - share.clamp(-1.0, 1.0) * w,
    }
}
