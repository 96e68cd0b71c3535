//! Why a figure cannot be given.

use core::fmt;

/// Why a figure cannot be given. Small, `Copy`, and carries the evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum MetricsError {
    /// Fewer samples (or blocks) than the figure needs.
    TooFew {
        /// What it needs.
        needed: u64,
        /// What there is.
        got: u64,
    },
    /// Two signals of different length.
    Lengths {
        /// Samples of the truth.
        truth: usize,
        /// Samples of the estimate.
        estimate: usize,
    },
    /// A sample that is not finite.
    NotFinite {
        /// Its index.
        index: usize,
    },
    /// A signal without spread: nothing can be divided by it.
    Constant {
        /// Which one: `truth`, `estimate`, `difference`.
        signal: &'static str,
    },
    /// A block of no sample.
    EmptyBlock,
}

impl fmt::Display for MetricsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooFew { needed, got } => write!(f, "{got} samples, but {needed} are needed"),
            Self::Lengths { truth, estimate } => {
                write!(f, "the truth has {truth} samples and the estimate {estimate}")
            }
            Self::NotFinite { index } => write!(f, "sample {index} is not finite"),
            Self::Constant { signal } => write!(f, "the {signal} is constant"),
            Self::EmptyBlock => write!(f, "a block needs at least one sample"),
        }
    }
}

impl core::error::Error for MetricsError {}
