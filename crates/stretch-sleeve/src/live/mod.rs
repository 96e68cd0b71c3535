//! What runs sample by sample, on a board as on a computer.

use stretch_core::Real;
use stretch_filter::LARGEST_SAMPLE;

mod channel_watch;
mod numbers;
mod reading;
mod receptor;
mod shift_watch;
mod zero_watch;

pub use channel_watch::{JUMP_SAMPLES, Jump, Repeats, samples_a_tick};
pub use numbers::{ArrayAloneNumbers, ArrayChannelNumbers, ArrayGainNumbers, ArrayNumbers};
pub use reading::{ArrayLoss, ArrayReading, ArrayWithheld};
pub use receptor::{ArrayMemory, ArrayReceptor};
pub use shift_watch::{ShiftMemory, ShiftWatch, Shifts, block_of};
pub use zero_watch::{TurnFinder, TurnMemory, Zero, ZeroMemory, ZeroWatch};

/// Whether a sample can be used; the comparison is false for NaN as well.
#[inline(always)]
fn is_usable<T: Real>(sample: T) -> bool {
    sample.abs() <= T::from_f64(LARGEST_SAMPLE)
}
