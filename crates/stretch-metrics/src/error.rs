//! The error of metrics.

use core::fmt;

/// The reason why a metric cannot be computed, with the offending values.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MetricsError {
    /// Fewer samples (or blocks) than the metric needs.
    TooFew {
        /// Number needed.
        needed: u64,
        /// Number given.
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
    /// A signal is constant, so its spread is zero and cannot be a divisor.
    Constant {
        /// Name of the signal: `truth`, `estimate` or `difference`.
        signal: &'static str,
    },
    /// A block length of 0.
    EmptyBlock,
}

impl fmt::Display for MetricsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::TooFew { needed, got } => write!(f, "{got} samples, but {needed} are needed"),
            Self::Lengths { truth, estimate } => {
                write!(f, "the truth has {truth} samples, but the estimate has {estimate}")
            }
            Self::NotFinite { index } => write!(f, "sample {index} is not finite"),
            Self::Constant { signal } => write!(f, "the {signal} is constant"),
            Self::EmptyBlock => write!(f, "a block needs at least one sample"),
        }
    }
}

impl core::error::Error for MetricsError {}
