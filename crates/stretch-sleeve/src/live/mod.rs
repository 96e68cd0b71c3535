//! The parts that run sample by sample, on a board or on a computer.

use stretch_core::Real;
use stretch_filter::LARGEST_SAMPLE;

mod channel_watch;
mod numbers;
mod receptor;
mod shift_watch;
mod zero_watch;

pub use channel_watch::{JUMP_SAMPLES, Jump, Repeats, samples_a_tick};
pub use numbers::{ArrayChannelNumbers, ArrayGainNumbers, ArrayNumbers};
pub use receptor::{ArrayMemory, ArrayReceptor};
pub use shift_watch::{ShiftMemory, ShiftWatch, Shifts, block_of};
pub use zero_watch::{TurnFinder, TurnMemory, Zero, ZeroMemory, ZeroWatch};

/// Returns whether a sample can be used. The comparison is also false for NaN.
#[inline(always)]
fn is_usable<T: Real>(sample: T) -> bool {
    sample.abs() <= T::from_f64(LARGEST_SAMPLE)
}

/// Why a channel is excluded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ArrayLoss {
    /// The channel's samples are missing.
    Missing,
    /// The channel's samples are impossible several times in a row: it is cut off, or at the end of the converter.
    Outside,
    /// The channel repeats one value while others change: it is stuck, or at the end of its converter.
    Still,
    /// The channel jumped away from what the other channels predict: it slipped, or it is loose.
    Slipped,
}

/// A reading of an [`ArrayReceptor`](crate::ArrayReceptor).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ArrayReading<T> {
    /// The estimated reference, in its unit.
    pub estimate: T,
    /// Standard deviation of the estimate from the remaining channels, in the same unit.
    pub sd: T,
    /// One bit for each excluded channel. The lowest bit is that of the first channel.
    pub lost: u16,
    /// Whether a state was outside its domain and was clamped.
    pub clamped: bool,
}

impl<T> ArrayReading<T> {
    /// Returns whether a channel is excluded.
    pub fn is_lost(&self, channel: usize) -> bool {
        channel < 16 && self.lost & (1 << channel) != 0
    }
}

/// Why there is no [`ArrayReading`] for a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ArrayWithheld {
    /// A channel in use has not had a sample yet.
    Warming,
    /// No channel in use had a sample. A short gap is bridged.
    Missing,
    /// Every channel is lost.
    AllLost,
}

impl core::fmt::Display for ArrayWithheld {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Warming => "warming",
            Self::Missing => "missing",
            Self::AllLost => "all channels lost",
        })
    }
}

impl core::error::Error for ArrayWithheld {}

impl core::fmt::Display for ArrayLoss {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Missing => "its samples are missing",
            Self::Outside => "its signal is outside the range that is possible for it",
            Self::Still => "its signal repeats one value while other signals change",
            Self::Slipped => "its signal jumped away from what the other signals predict",
        })
    }
}
