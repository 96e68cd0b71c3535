//! A streaming paired t test.

use stretch_core::{Interval, Real};

use crate::{
    MetricsError,
    student_t::{critical, ln_two_tailed, two_tailed},
    sum::{Moments, largest},
};

/// Accumulates the differences of paired samples for Student's paired t test.
///
/// With the differences d, t = mean(d) / (s_d / sqrt(n)) with n - 1 degrees of freedom. The test assumes independent
/// pairs. Neighbouring samples of a recording are correlated, so P is far too small.
/// [`PairedBlocks`](crate::PairedBlocks) tests means over blocks, which gives a more realistic P. Report both values.
///
/// ```
/// use stretch_metrics::PairedT;
/// let mut test = PairedT::<f64>::new();
/// for (linear, surface) in [(1.9, 1.5), (1.7, 1.6), (2.1, 1.4), (1.8, 1.6)] {
///     test.push(linear - surface);
/// }
/// let result = test.test()?;
/// assert_eq!(result.dof, 3);
/// approx::assert_abs_diff_eq!(result.mean_difference, 0.35, epsilon = 1e-15);
/// approx::assert_abs_diff_eq!(result.t, 2.645_751_311_064_59, epsilon = 1e-12);
/// approx::assert_abs_diff_eq!(result.p, 0.077_274_29, epsilon = 1e-6);
/// # Ok::<(), stretch_metrics::MetricsError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedT<T> {
    moments: Moments<T>,
    skipped: u64,
}

/// Result of a paired t test.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TTest {
    /// Number of pairs or blocks.
    pub count: u64,
    /// Mean of the differences, in their unit.
    pub mean_difference: f64,
    /// Standard error of that mean.
    pub standard_error: f64,
    /// `mean_difference / standard_error`.
    pub t: f64,
    /// Degrees of freedom: `count - 1`.
    pub dof: u64,
    /// Two-tailed P; 0 if it is below the smallest `f64` (then see `ln_p`).
    pub p: f64,
    /// Natural logarithm of the two-tailed P, which is finite even if P underflows.
    pub ln_p: f64,
    /// Ends of the 95 % interval of the mean difference.
    pub interval_95: Interval,
}

impl TTest {
    /// Returns the two-sided confidence interval of the mean difference at `level`, such as 0.99.
    pub fn interval(&self, level: f64) -> Interval {
        let half = critical(1.0 - level, self.dof as f64) * self.standard_error;
        Interval { min: self.mean_difference - half, max: self.mean_difference + half }
    }
}

impl<T: Real> Default for PairedT<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> PairedT<T> {
    /// Creates a test without pairs.
    pub fn new() -> Self {
        Self { moments: Moments::new(), skipped: 0 }
    }

    /// Adds the difference of a pair and returns whether it was accepted. A difference that is not finite,
    /// or too large to be squared (see [`ErrorStats`](crate::ErrorStats)), is refused.
    #[inline]
    pub fn push(&mut self, difference: T) -> bool {
        let taken = difference.abs() <= largest();
        if taken {
            self.moments.push(difference);
        } else {
            self.skipped += 1;
        }
        taken
    }

    /// Adds all pairs of another stream.
    pub fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        self.skipped += other.skipped;
    }

    /// Returns the number of accepted pairs.
    pub fn count(&self) -> u64 {
        self.moments.count()
    }

    /// Returns the number of refused pairs.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Tests the hypothesis that the mean difference is 0.
    ///
    /// # Errors
    /// [`MetricsError::TooFew`] for fewer than two pairs; [`MetricsError::Constant`] if all
    /// differences are equal, because t would be x / 0.
    pub fn test(&self) -> Result<TTest, MetricsError> {
        let count = self.count();
        let std_dev =
            self.moments.std_dev().ok_or(MetricsError::TooFew { needed: 2, got: count })?;
        let standard_error = std_dev.as_f64() / libm::sqrt(count as f64);
        let mean_difference = self.moments.mean().as_f64();
        let t = mean_difference / standard_error;
        // t is not finite for 0 / 0, x / 0, or a quotient that overflows.
        if !t.is_finite() {
            return Err(MetricsError::Constant { signal: "difference" });
        }
        let dof = count - 1;
        let mut test = TTest {
            count,
            mean_difference,
            standard_error,
            t,
            dof,
            p: two_tailed(t, dof as f64),
            ln_p: ln_two_tailed(t, dof as f64),
            interval_95: Interval { min: 0.0, max: 0.0 },
        };
        test.interval_95 = test.interval(0.95);
        Ok(test)
    }
}
