//! A rising line between evenly spaced knots, forwards and backwards.

use stretch_core::{Interval, MAX_KNOTS, Real};

use crate::fold::{held, rounded};

/// A rising line of signals over evenly spaced drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve<T> {
    /// Knots.
    pub knots: usize,
    /// Signed signals at them.
    pub values: [T; MAX_KNOTS],
    /// The drive of the first.
    pub low: T,
    /// From knot to knot.
    pub step: T,
    /// Its reciprocal.
    pub per_step: T,
}

impl<T: Real> Curve<T> {
    /// Of signed values over a domain of drives.
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

    /// The drive that a signal suggests by itself; beyond an end as the last line goes on. Whether the signal lies on the curve.
    #[inline(always)]
    pub(crate) fn inverse(&self, signal: T) -> (T, bool) {
        let (first, last) = self.ends();
        // the last knot at or below, by halving
        let (mut below, mut above) = (0, self.knots - 1);
        while above - below > 1 {
            let middle = (below + above) / 2;
            if self.values[middle] <= signal { below = middle } else { above = middle }
        }
        let rise = self.values[below + 1] - self.values[below];
        let place = T::from_f64(below as f64) + (signal - self.values[below]) / rise;
        (self.low + place * self.step, signal >= first && signal <= last)
    }

    /// The signal at a drive and the slope there; beyond an end as the last line goes on.
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
