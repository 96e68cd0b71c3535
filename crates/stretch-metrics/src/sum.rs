//! Running sums and moments that stay accurate over long streams.

use stretch_core::Real;

/// A compensated sum: the sum and its accumulated rounding error (Neumaier,
/// doi:10.1002/zamm.19740540106).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Sum<T> {
    high: T,
    low: T,
}

impl<T: Real> Sum<T> {
    pub(crate) fn new() -> Self {
        Self { high: T::zero(), low: T::zero() }
    }

    #[inline]
    pub(crate) fn add(&mut self, x: T) {
        // Knuth's two-sum, which is exact without comparing the magnitudes.
        let high = self.high + x;
        let part = high - self.high;
        self.low = self.low + ((self.high - (high - part)) + (x - part));
        self.high = high;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.add(other.high);
        self.low = self.low + other.low;
    }

    #[inline]
    pub(crate) fn value(&self) -> T {
        self.high + self.low
    }

    pub(crate) fn parts(&self) -> [T; 2] {
        [self.high, self.low]
    }

    pub(crate) fn of([high, low]: [T; 2]) -> Self {
        Self { high, low }
    }
}

/// Count, mean and sum of squared deviations (Welford, doi:10.1080/00401706.1962.10490022).
/// Mean and sum of squares are compensated sums.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Moments<T> {
    count: u64,
    mean: Sum<T>,
    squares: Sum<T>,
}

impl<T: Real> Moments<T> {
    pub(crate) fn new() -> Self {
        Self { count: 0, mean: Sum::new(), squares: Sum::new() }
    }

    /// Adds a sample, and returns its deviations from the mean before and after the update.
    #[inline]
    pub(crate) fn push(&mut self, x: T) -> (T, T) {
        self.count += 1;
        let before = x - self.mean.value();
        self.mean.add(before / real(self.count));
        let after = x - self.mean.value();
        self.squares.add(before * after);
        (before, after)
    }

    /// Adds the samples of another stream (Chan, Golub and LeVeque 1979).
    pub(crate) fn merge(&mut self, other: &Self) {
        if other.count == 0 {
            return;
        }
        if self.count == 0 {
            *self = *other;
            return;
        }
        let count = self.count.saturating_add(other.count);
        let delta = other.mean.value() - self.mean.value();
        let share = real::<T>(other.count) / real(count);
        self.squares.merge(&other.squares);
        self.squares.add(delta * delta * (real::<T>(self.count) * share));
        self.mean.add(delta * share);
        self.count = count;
    }

    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    pub(crate) fn parts(&self) -> [T; 4] {
        let ([a, b], [c, d]) = (self.mean.parts(), self.squares.parts());
        [a, b, c, d]
    }

    pub(crate) fn of(count: u64, [a, b, c, d]: [T; 4]) -> Self {
        Self { count, mean: Sum::of([a, b]), squares: Sum::of([c, d]) }
    }

    pub(crate) fn mean(&self) -> T {
        self.mean.value()
    }

    /// Returns the sum of squared deviations from the mean, at least 0.
    pub(crate) fn squares(&self) -> T {
        self.squares.value().max(T::zero())
    }

    /// Returns the standard deviation with n - 1; `None` for fewer than two samples.
    pub(crate) fn std_dev(&self) -> Option<T> {
        (self.count > 1).then(|| (self.squares() / real(self.count - 1)).sqrt())
    }
}

/// Converts a count to the sample type.
#[inline]
pub(crate) fn real<T: Real>(count: u64) -> T {
    T::from_f64(count as f64)
}

/// Returns the largest accepted magnitude: a sum of 2^28 squares of it is still finite.
#[inline]
pub(crate) fn largest<T: Real>() -> T {
    T::max_value().sqrt() / T::from_f64(16384.0)
}
