//! The resting baseline, followed live.

use stretch_core::{Calibration, Real, RestTracker};

/// [`RestTracker`] with its rates folded to one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RestLevel<T> {
    level: T,
    /// Share of the excess that is taken up in a sample; zero: nothing is followed.
    pull: T,
    leak: T,
    /// The most that a sample may lie beyond the level and count: drift is slow, a spike is not drift.
    most: T,
}

/// Share of the signal's range that a sample beyond the resting level counts for at most.
const MOST_EXCESS: f64 = 0.1;

impl<T: Real> RestLevel<T> {
    pub(crate) fn new(rest: Option<RestTracker>, calibration: &Calibration) -> Self {
        let period_s = calibration.sample_rate_hz.period_s();
        match rest {
            None => Self { level: T::zero(), pull: T::zero(), leak: T::zero(), most: T::zero() },
            Some(rest) => Self {
                level: T::from_f64(calibration.polarity.sign() * rest.level),
                pull: T::from_f64((period_s / rest.catch_up_s).min(1.0)),
                leak: T::from_f64(rest.leak * period_s),
                most: T::from_f64(MOST_EXCESS * calibration.signal_range.span()),
            },
        }
    }

    /// Moves the baseline for a signed signal and returns the signal above it.
    #[inline(always)]
    pub(crate) fn step(&self, baseline: &mut T, signal: T) -> T {
        if self.pull == T::zero() {
            return signal;
        }
        let excess = signal - *baseline - self.level;
        *baseline = *baseline
            + if excess < T::zero() { self.pull * excess.max(-self.most) } else { self.leak };
        signal - *baseline
    }
}
