//! The resting baseline, followed live.

use stretch_core::{Calibration, Real, RestTracker};

use crate::fold::share_of;

/// [`RestTracker`] with its rates folded to one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RestLevel<T> {
    level: T,
    /// Share of the excess that is taken up in a sample; zero: nothing is followed.
    pull: T,
    leak: T,
    /// Share of a sample in the running average of the excess.
    average: T,
    furthest: T,
    /// The most that a sample may lie beyond the level and count: drift is slow, a spike is not drift.
    most: T,
}

/// Share of the signal's range that a sample beyond the resting level counts for at most.
const MOST_EXCESS: f64 = 0.1;

impl<T: Real> RestLevel<T> {
    pub(crate) fn new(rest: Option<RestTracker>, calibration: &Calibration) -> Self {
        let period_s = calibration.sample_rate_hz.period_s();
        match rest {
            None => {
                let zero = T::zero();
                Self {
                    level: zero,
                    pull: zero,
                    leak: zero,
                    average: zero,
                    furthest: zero,
                    most: zero,
                }
            }
            Some(rest) => Self {
                level: T::from_f64(calibration.polarity.sign() * rest.level),
                pull: T::from_f64((period_s / rest.catch_up_s).min(1.0)),
                leak: T::from_f64(rest.leak * period_s),
                average: T::from_f64(share_of(period_s, RestTracker::AVERAGE_S)),
                furthest: T::from_f64(RestTracker::FURTHEST * calibration.signal_range.span()),
                most: T::from_f64(MOST_EXCESS * calibration.signal_range.span()),
            },
        }
    }

    /// Whether a baseline is followed at all.
    #[inline(always)]
    pub(crate) fn follows(&self) -> bool {
        self.pull != T::zero()
    }

    /// Moves the baseline for a signed signal, where memory moves the resting level
    /// by `shift`, and returns the signal above it.
    #[inline(always)]
    pub(crate) fn step(&self, baseline: &mut Baseline<T>, signal: T, shift: T) -> T {
        if !self.follows() {
            return signal;
        }
        let excess = signal - baseline.at - (self.level + shift);
        let held = excess.max(-self.most).min(self.most);
        baseline.excess = baseline.excess + self.average * (held - baseline.excess);
        let wanted =
            if baseline.excess < T::zero() { self.pull * baseline.excess } else { self.leak };
        let before = baseline.at;
        baseline.at = (before + wanted).max(-self.furthest).min(self.furthest);
        // the average is of what lies above the baseline as it is now
        baseline.excess = baseline.excess - (baseline.at - before);
        signal - baseline.at
    }
}

/// Where the baseline is, and how far the signal has been above rest of late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Baseline<T> {
    at: T,
    excess: T,
}

impl<T: Real> Baseline<T> {
    pub(crate) fn unmoved() -> Self {
        Self { at: T::zero(), excess: T::zero() }
    }
}
