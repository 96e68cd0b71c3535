//! Agreement of an estimate with the truth, in the unit of both and in percent.

use stretch_core::{Interval, Real};

use crate::{
    ErrorStats, Pair,
    sum::{Moments, Sum, largest, real},
};

/// The range by which an error is divided to give a percentage.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Delta {
    /// The range of the estimate: delta in equation 1 of the published method ("the paper").
    Estimate,
    /// The range of the truth: the stroke. This is fairer: with [`Delta::Estimate`], an estimate with too large a range
    /// reduces its own error.
    Truth,
}

/// Streaming [`ErrorStats`] with the ranges of both signals, R^2 and correlation.
///
/// The paper's measures (its section 2, with d_p the truth and d_s the estimate):
///
/// ```text
/// average error   100 mean(|d_p - d_s|) / delta      average_error_percent(delta)
/// signed          100 mean(d_p - d_s) / delta        signed_error_percent(delta)
/// RMSE            sqrt(mean((d_p - d_s)^2))          errors().rmse(), rmse_percent(delta)
/// R^2             1 - sum((d_p - d_s)^2) / sum((d_p - mean d_p)^2)
/// ```
///
/// ```
/// use stretch_metrics::{Agreement, Delta, Pair};
/// let mut agreement = Agreement::<f64>::new();
/// for (truth, estimate) in [(150.0, 152.0), (160.0, 160.0), (170.0, 172.0), (180.0, 176.0)] {
///     agreement.push(Pair { truth, estimate });
/// }
/// assert_eq!(agreement.truth_range().unwrap().max, 180.0);
/// assert_eq!(agreement.average_error_percent(Delta::Estimate), Some(100.0 * 2.0 / 24.0));
/// assert_eq!(agreement.average_error_percent(Delta::Truth), Some(100.0 * 2.0 / 30.0));
/// assert_eq!(agreement.r_squared(), Some(1.0 - 24.0 / 500.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement<T> {
    errors: ErrorStats<T>,
    truth: Spread<T>,
    estimate: Spread<T>,
    products: Sum<T>,
}

/// The numbers of an [`Agreement`], for storage or transmission. [`Agreement::from_spec`] converts
/// them back.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AgreementSpec<T> {
    /// Number of accepted pairs.
    pub count: u64,
    /// Number of refused pairs.
    pub skipped: u64,
    /// Statistics of the error: mean, sum of squared deviations, and sum of magnitudes, each
    /// followed by its rounding error; then the largest magnitude.
    pub errors: [T; 7],
    /// Statistics of the truth: mean and sum of squared deviations, each followed by its rounding
    /// error; then minimum and maximum.
    pub truth: [T; 6],
    /// The same statistics of the estimate.
    pub estimate: [T; 6],
    /// Sum of the products of both deviations, and its rounding error.
    pub products: [T; 2],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Spread<T> {
    moments: Moments<T>,
    min: T,
    max: T,
}

impl<T: Real> Spread<T> {
    fn new() -> Self {
        Self { moments: Moments::new(), min: T::max_value(), max: T::min_value() }
    }

    fn push(&mut self, x: T) -> (T, T) {
        self.min = self.min.min(x);
        self.max = self.max.max(x);
        self.moments.push(x)
    }

    fn merge(&mut self, other: &Self) {
        self.moments.merge(&other.moments);
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    fn parts(&self) -> [T; 6] {
        let [a, b, c, d] = self.moments.parts();
        [a, b, c, d, self.min, self.max]
    }

    fn of(count: u64, [a, b, c, d, min, max]: [T; 6]) -> Self {
        Self { moments: Moments::of(count, [a, b, c, d]), min, max }
    }

    fn range(&self) -> Option<(T, T)> {
        (self.moments.count() > 0).then_some((self.min, self.max))
    }

    fn interval(&self) -> Option<Interval> {
        self.range().map(|(min, max)| Interval { min: min.as_f64(), max: max.as_f64() })
    }
}

impl<T: Real> Default for Agreement<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Agreement<T> {
    /// Creates an agreement without samples.
    pub fn new() -> Self {
        Self {
            errors: ErrorStats::new(),
            truth: Spread::new(),
            estimate: Spread::new(),
            products: Sum::new(),
        }
    }

    /// Adds a pair and returns whether it was accepted. A pair that is not finite, or too large to
    /// be squared (see [`ErrorStats`]), is refused.
    #[inline]
    pub fn push(&mut self, Pair { truth, estimate }: Pair<T>) -> bool {
        let limit = largest::<T>();
        let sound = truth.abs() <= limit && estimate.abs() <= limit;
        let taken = sound && self.errors.push(Pair { truth, estimate });
        if taken {
            let (before, _) = self.truth.push(truth);
            let (_, after) = self.estimate.push(estimate);
            self.products.add(before * after);
        } else if !sound {
            self.errors.skip();
        }
        taken
    }

    /// Adds all samples of another stream, such as another trial.
    pub fn merge(&mut self, other: &Self) {
        let (own, others) = (self.errors.count(), other.errors.count());
        if own > 0 && others > 0 {
            let by_truth = other.truth.moments.mean() - self.truth.moments.mean();
            let by_estimate = other.estimate.moments.mean() - self.estimate.moments.mean();
            let share = real::<T>(others) / real(own + others);
            self.products.add(by_truth * by_estimate * (real::<T>(own) * share));
        }
        self.products.merge(&other.products);
        self.errors.merge(&other.errors);
        self.truth.merge(&other.truth);
        self.estimate.merge(&other.estimate);
    }

    /// Returns the numbers of the agreement.
    pub fn spec(&self) -> AgreementSpec<T> {
        AgreementSpec {
            count: self.count(),
            skipped: self.skipped(),
            errors: self.errors.parts(),
            truth: self.truth.parts(),
            estimate: self.estimate.parts(),
            products: self.products.parts(),
        }
    }

    /// Creates an agreement from the numbers that [`spec`](Self::spec) returned, bit for bit.
    /// `None` if one of them is not finite.
    ///
    /// ```
    /// use stretch_metrics::{Agreement, Pair};
    /// let mut agreement = Agreement::<f64>::new();
    /// agreement.push(Pair { truth: 150.0, estimate: 152.0 });
    /// assert_eq!(Agreement::from_spec(agreement.spec()), Some(agreement));
    /// ```
    pub fn from_spec(spec: AgreementSpec<T>) -> Option<Self> {
        let AgreementSpec { count, skipped, errors, truth, estimate, products } = spec;
        let mut all = errors.iter().chain(&truth).chain(&estimate).chain(&products);
        all.all(|x| x.is_finite()).then(|| Self {
            errors: ErrorStats::of(count, skipped, errors),
            truth: Spread::of(count, truth),
            estimate: Spread::of(count, estimate),
            products: Sum::of(products),
        })
    }

    /// Returns bias, MAE, RMSE and the other error statistics, in the unit of the signals.
    pub fn errors(&self) -> &ErrorStats<T> {
        &self.errors
    }

    /// Returns the number of accepted pairs.
    pub fn count(&self) -> u64 {
        self.errors.count()
    }

    /// Returns the number of refused pairs.
    pub fn skipped(&self) -> u64 {
        self.errors.skipped()
    }

    /// Returns the minimum and maximum of the truth. `None` if there are no samples.
    pub fn truth_range(&self) -> Option<Interval> {
        self.truth.interval()
    }

    /// Returns the minimum and maximum of the estimate. `None` if there are no samples.
    pub fn estimate_range(&self) -> Option<Interval> {
        self.estimate.interval()
    }

    /// Returns the paper's average error: 100 mean(|d_p - d_s|) / delta. `None` if there are no
    /// samples, or if delta is 0 or too small to divide by.
    pub fn average_error_percent(&self, delta: Delta) -> Option<T> {
        self.percent(self.errors.mae()?, delta)
    }

    /// Returns 100 mean(d_p - d_s) / delta, with the sign of the paper's equation: positive
    /// if the estimate is too *small*, the opposite of [`ErrorStats::bias`]. `None` as for
    /// [`average_error_percent`](Self::average_error_percent).
    pub fn signed_error_percent(&self, delta: Delta) -> Option<T> {
        self.percent(-self.errors.bias()?, delta)
    }

    /// Returns 100 RMSE / delta. With [`Delta::Truth`] it is in percent of the stroke. `None` as
    /// for [`average_error_percent`](Self::average_error_percent).
    pub fn rmse_percent(&self, delta: Delta) -> Option<T> {
        self.percent(self.errors.rmse()?, delta)
    }

    /// Returns R^2 = 1 - SSE / SST of the estimate without refitting: 1 is perfect, 0 is as good as
    /// the mean of the truth, below 0 is worse. `None` if there are no samples or the truth is
    /// constant (or so nearly constant that R^2 overflows).
    pub fn r_squared(&self) -> Option<T> {
        let total = self.truth.moments.squares();
        if total <= T::zero() {
            return None;
        }
        Some(T::one() - self.errors.sum_of_squares() / total).filter(|r| r.is_finite())
    }

    /// Returns Pearson's correlation of truth and estimate, -1..1, which does not depend on bias
    /// and scale. `None` if either is constant.
    pub fn correlation(&self) -> Option<T> {
        let scale = self.truth.moments.squares().sqrt() * self.estimate.moments.squares().sqrt();
        let one = T::one();
        (scale > T::zero()).then(|| (self.products.value() / scale).max(-one).min(one))
    }

    fn percent(&self, error: T, delta: Delta) -> Option<T> {
        let (min, max) = match delta {
            Delta::Estimate => self.estimate.range()?,
            Delta::Truth => self.truth.range()?,
        };
        if max <= min {
            return None;
        }
        Some(T::from_f64(100.0) * error / (max - min)).filter(|percent| percent.is_finite())
    }
}
