//! Streaming error statistics of an estimate.

use stretch_core::Real;

use crate::sum::{Moments, Sum, largest, real};

/// A true value and its estimate, in one unit.
///
/// ```
/// use stretch_metrics::{ErrorStats, Pair};
/// let mut stats = ErrorStats::new();
/// assert!(stats.push(Pair { truth: 20.0, estimate: 17.0 }));
/// assert_eq!(stats.bias(), Some(-3.0), "the estimate is too small");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pair<T> {
    /// The true value.
    pub truth: T,
    /// The estimate of it.
    pub estimate: T,
}

/// Error statistics of an estimate against the truth: count, bias, MAE, RMSE, standard deviation,
/// largest error.
///
/// The error is e = estimate - truth, in the unit of both. Moments are computed by Welford's method with compensated
/// sums. Therefore even an `f32` stream of ten million samples loses no digits. [`merge`](Self::merge) gives the same
/// result, up to rounding, as one stream of all samples.
///
/// A pair that is not finite, or whose squared errors could overflow in a sum (magnitude above
/// about 1e15 in `f32`, 1e150 in `f64`), is refused and counted in [`skipped`](Self::skipped).
///
/// ```
/// use stretch_metrics::{ErrorStats, Pair};
/// let mut stats = ErrorStats::<f64>::new();
/// for (truth, estimate) in [(10.0, 11.0), (20.0, 17.0)] {
///     stats.push(Pair { truth, estimate });
/// }
/// assert_eq!(stats.bias(), Some(-1.0));
/// assert_eq!(stats.mae(), Some(2.0));
/// assert_eq!(stats.rmse(), Some(5.0_f64.sqrt()));
/// assert_eq!(stats.max_abs(), Some(3.0));
/// assert_eq!(ErrorStats::<f64>::new().rmse(), None);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorStats<T> {
    moments: Moments<T>,
    absolute: Sum<T>,
    largest: T,
    skipped: u64,
}

impl<T: Real> Default for ErrorStats<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> ErrorStats<T> {
    /// Creates statistics without samples.
    pub fn new() -> Self {
        Self { moments: Moments::new(), absolute: Sum::new(), largest: T::zero(), skipped: 0 }
    }

    /// Adds a pair and returns whether it was accepted.
    #[inline]
    pub fn push(&mut self, Pair { truth, estimate }: Pair<T>) -> bool {
        let error = estimate - truth;
        let size = error.abs();
        // Also false for NaN.
        let taken = size <= largest();
        if taken {
            self.moments.push(error);
            self.absolute.add(size);
            self.largest = self.largest.max(size);
        } else {
            self.skip();
        }
        taken
    }

    /// Counts a refused pair.
    pub(crate) fn skip(&mut self) {
        self.skipped += 1;
    }

    /// Adds all samples of another stream.
    pub fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        self.absolute.merge(&other.absolute);
        self.largest = self.largest.max(other.largest);
        self.skipped = self.skipped.saturating_add(other.skipped);
    }

    /// Returns the number of accepted pairs.
    pub fn count(&self) -> u64 {
        self.moments.count()
    }

    /// Returns the number of refused pairs.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Returns the mean error, which is positive if the estimate is too large. `None` if there are
    /// no samples.
    pub fn bias(&self) -> Option<T> {
        (self.count() > 0).then(|| self.moments.mean())
    }

    /// Returns the mean magnitude of the error. `None` if there are no samples.
    pub fn mae(&self) -> Option<T> {
        (self.count() > 0).then(|| self.absolute.value() / real(self.count()))
    }

    /// Returns the square root of the mean squared error (divided by n). `None` if there are no
    /// samples.
    pub fn rmse(&self) -> Option<T> {
        (self.count() > 0).then(|| (self.sum_of_squares() / real(self.count())).sqrt())
    }

    /// Returns the standard deviation of the error about its mean (divided by n - 1). `None` for
    /// fewer than two samples.
    pub fn std_dev(&self) -> Option<T> {
        self.moments.std_dev()
    }

    /// Returns the largest magnitude of the error. `None` if there are no samples.
    pub fn max_abs(&self) -> Option<T> {
        (self.count() > 0).then_some(self.largest)
    }

    pub(crate) fn parts(&self) -> [T; 7] {
        let ([a, b, c, d], [e, f]) = (self.moments.parts(), self.absolute.parts());
        [a, b, c, d, e, f, self.largest]
    }

    pub(crate) fn of(count: u64, skipped: u64, [a, b, c, d, e, f, largest]: [T; 7]) -> Self {
        let (moments, absolute) = (Moments::of(count, [a, b, c, d]), Sum::of([e, f]));
        Self { moments, absolute, largest, skipped }
    }

    /// Returns the sum of the squared errors.
    pub(crate) fn sum_of_squares(&self) -> T {
        let mean = self.moments.mean();
        self.moments.squares() + mean * mean * real(self.count())
    }
}
