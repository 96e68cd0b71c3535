//! Block means, which make the samples of a recording nearly independent.

use stretch_core::Real;

use crate::{
    MetricsError, PairedT, TTest,
    sum::{Sum, real},
};

/// Streaming means over blocks of a fixed number of samples.
///
/// An incomplete block gives no mean. The mean is computed with compensated summation.
///
/// ```
/// use stretch_metrics::BlockMeans;
/// let mut blocks = BlockMeans::<f64>::new(2)?;
/// assert_eq!(blocks.push(1.0), None);
/// assert_eq!(blocks.push(2.0), Some(1.5));
/// # Ok::<(), stretch_metrics::MetricsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockMeans<T> {
    length: u64,
    filled: u64,
    sum: Sum<T>,
}

impl<T: Real> BlockMeans<T> {
    /// Creates block means over `length` samples. The reports use half a second, which is 50
    /// samples at 100 Hz.
    ///
    /// # Errors
    /// [`MetricsError::EmptyBlock`] for a length of 0.
    pub fn new(length: u64) -> Result<Self, MetricsError> {
        if length == 0 {
            return Err(MetricsError::EmptyBlock);
        }
        Ok(Self { length, filled: 0, sum: Sum::new() })
    }

    /// Adds a sample, and returns the mean of the block if this completes it.
    #[inline]
    pub fn push(&mut self, x: T) -> Option<T> {
        self.sum.add(x);
        self.filled += 1;
        if self.filled < self.length {
            return None;
        }
        let mean = self.sum.value() / real(self.length);
        self.end_recording();
        Some(mean)
    }

    /// Discards the incomplete block, because the next sample belongs to another recording.
    pub fn end_recording(&mut self) {
        self.filled = 0;
        self.sum = Sum::new();
    }
}

/// A [`PairedT`] test on the means over blocks of samples.
///
/// ```
/// use stretch_metrics::PairedBlocks;
/// let mut test = PairedBlocks::<f64>::new(2)?;
/// for (first, second) in [(1.0, 0.0), (3.0, 1.0), (2.0, 1.5), (2.0, 0.5), (9.0, 9.0)] {
///     test.push(first - second);
/// }
/// assert_eq!(test.test()?.count, 2, "the fifth pair is no block");
/// assert_eq!(test.test()?.mean_difference, 1.25);
/// # Ok::<(), stretch_metrics::MetricsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedBlocks<T> {
    blocks: BlockMeans<T>,
    test: PairedT<T>,
    skipped: u64,
}

impl<T: Real> PairedBlocks<T> {
    /// Creates a test over blocks of `length` pairs.
    ///
    /// # Errors
    /// [`MetricsError::EmptyBlock`] for a length of 0.
    pub fn new(length: u64) -> Result<Self, MetricsError> {
        Ok(Self { blocks: BlockMeans::new(length)?, test: PairedT::new(), skipped: 0 })
    }

    /// Adds the difference of a pair and returns whether it was accepted. A difference that [`PairedT`]
    /// would refuse also discards the incomplete block.
    #[inline]
    pub fn push(&mut self, difference: T) -> bool {
        let taken = difference.abs() <= crate::sum::largest();
        if !taken {
            self.skipped += 1;
            self.blocks.end_recording();
        } else if let Some(mean) = self.blocks.push(difference) {
            self.test.push(mean);
        }
        taken
    }

    /// Discards the incomplete block, because the next pair belongs to another recording.
    pub fn end_recording(&mut self) {
        self.blocks.end_recording();
    }

    /// Adds all complete blocks of another recording, which should have the same block length.
    pub fn merge(&mut self, other: &Self) {
        self.test.merge(&other.test);
        self.skipped += other.skipped;
    }

    /// Returns the number of refused pairs.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Returns the number of complete blocks.
    pub fn count(&self) -> u64 {
        self.test.count()
    }

    /// Tests the hypothesis that the mean difference is 0 on the block means.
    ///
    /// # Errors
    /// The errors of [`PairedT::test`], with blocks in place of pairs.
    pub fn test(&self) -> Result<TTest, MetricsError> {
        self.test.test()
    }
}
