//! A rising piecewise linear curve with evenly spaced knots, and its inverse.

use stretch_core::{Interval, MAX_KNOTS, Real};

use crate::fold::{held, rounded};

/// A rising piecewise linear curve from drives (inputs of the curve) to signals, with evenly spaced knots.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve<T> {
    /// Number of knots.
    pub knots: usize,
    /// Signals at the knots, negated if the signal falls as the target rises.
    pub values: [T; MAX_KNOTS],
    /// The drive of the first knot.
    pub low: T,
    /// Difference of the drives of neighbouring knots.
    pub step: T,
    /// Reciprocal of `step`.
    pub per_step: T,
}

impl<T: Real> Curve<T> {
    /// Creates the curve through signals at evenly spaced drives over a domain.
    pub(crate) fn new(values: impl ExactSizeIterator<Item = f64>, domain: Interval) -> Self {
        let knots = values.len();
        let step = (domain.max - domain.min) / (knots - 1) as f64;
        Self {
            knots,
            values: rounded(values),
            low: T::from_f64(domain.min),
            step: T::from_f64(step),
            per_step: T::from_f64(step.recip()),
        }
    }

    /// The first and the last signal.
    #[inline(always)]
    pub(crate) fn ends(&self) -> (T, T) {
        (self.values[0], self.values[self.knots - 1])
    }

    /// Returns the drive at which the curve takes the value `signal`, and whether the signal lies between the ends of
    /// the curve. Beyond an end, the segment at that end is extended.
    #[inline(always)]
    pub(crate) fn inverse(&self, signal: T) -> (T, bool) {
        let (first, last) = self.ends();
        // bisection for the last knot at or below the signal
        let (mut below, mut above) = (0, self.knots - 1);
        while above - below > 1 {
            let middle = (below + above) / 2;
            if self.values[middle] <= signal { below = middle } else { above = middle }
        }
        let rise = self.values[below + 1] - self.values[below];
        let place = T::from_f64(below as f64) + (signal - self.values[below]) / rise;
        (self.low + place * self.step, signal >= first && signal <= last)
    }

    /// The signal at a drive, and the slope at that drive. Beyond an end the last segment is extended.
    #[inline(always)]
    pub(crate) fn forward(&self, drive: T) -> (T, T) {
        let most = T::from_f64((self.knots - 2) as f64);
        let place = (drive - self.low) * self.per_step;
        let below = held(place, T::zero(), most).to_usize().unwrap_or(0).min(self.knots - 2);
        let rise = self.values[below + 1] - self.values[below];
        let share = place - T::from_f64(below as f64);
        (self.values[below] + share * rise, rise * self.per_step)
    }
}
