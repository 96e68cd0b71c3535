//! Means over blocks: samples of a recording made nearly independent.

use stretch_core::Real;

use crate::{
    MetricsError, PairedT, TTest,
    sum::{Sum, real},
};

/// Means over blocks of a fixed number of samples, streaming.
///
/// The design is the length; a block that is not complete gives no mean. The mean is
/// summed with compensation.
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
    /// Blocks of `length` samples: 50 for the half second that the reports use at 100 Hz.
    ///
    /// # Errors
    /// [`MetricsError::EmptyBlock`] for a length of 0.
    pub fn new(length: u64) -> Result<Self, MetricsError> {
        if length == 0 {
            return Err(MetricsError::EmptyBlock);
        }
        Ok(Self { length, filled: 0, sum: Sum::new() })
    }

    /// Takes a sample; the block's mean when that completes a block.
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

    /// Drops the block that is not complete: the next sample is of another recording.
    pub fn end_recording(&mut self) {
        self.filled = 0;
        self.sum = Sum::new();
    }

    /// Samples in the block that is not complete.
    pub fn pending(&self) -> u64 {
        self.filled
    }
}

/// [`PairedT`] on means over blocks of samples.
///
/// ```
/// use stretch_metrics::PairedBlocks;
/// let mut test = PairedBlocks::<f64>::new(2)?;
/// for (first, second) in [(1.0, 0.0), (3.0, 1.0), (2.0, 1.5), (2.0, 0.5), (9.0, 9.0)] {
///     test.push(first, second);
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
    /// Blocks of `length` pairs.
    ///
    /// # Errors
    /// [`MetricsError::EmptyBlock`] for a length of 0.
    pub fn new(length: u64) -> Result<Self, MetricsError> {
        Ok(Self { blocks: BlockMeans::new(length)?, test: PairedT::new(), skipped: 0 })
    }

    /// Takes a pair; whether it was taken. One that [`PairedT`] would not take ends the block.
    #[inline]
    pub fn push(&mut self, first: T, second: T) -> bool {
        let difference = first - second;
        let taken = difference.abs() <= crate::sum::largest();
        if !taken {
            self.skipped += 1;
            self.blocks.end_recording();
        } else if let Some(mean) = self.blocks.push(difference) {
            self.test.push(mean, T::zero());
        }
        taken
    }

    /// Drops the block that is not complete: the next pair is of another recording.
    pub fn end_recording(&mut self) {
        self.blocks.end_recording();
    }

    /// Takes all complete blocks of another recording; the lengths of the blocks should agree.
    pub fn merge(&mut self, other: &Self) {
        self.test.merge(&other.test);
        self.skipped += other.skipped;
    }

    /// Pairs not taken.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Complete blocks.
    pub fn count(&self) -> u64 {
        self.test.count()
    }

    /// The test of "the mean difference is 0" on the block means.
    ///
    /// # Errors
    /// As [`PairedT::test`], with blocks for pairs.
    pub fn test(&self) -> Result<TTest, MetricsError> {
        self.test.test()
    }
}
