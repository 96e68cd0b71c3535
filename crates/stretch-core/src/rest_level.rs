//! The resting baseline, stepped sample by sample.

use crate::{
    Design, Polarity, Range, Real, RestTracker, SampleRate,
    arithmetic::{lag, lag_share},
};

/// [`RestTracker`] with its rates folded to one sample.
///
/// ```
/// use stretch_core::*;
/// let range = Range::new(RangeSpec { mode: Normalisation::MinMax, zero: 0.0, min: 1.0, max: 2.0 })?;
/// let tracker = RestTracker { level: 1.0, catch_up_s: 0.5, leak: 0.0 };
/// let rate = SampleRate::new(100.0)?;
/// let level = RestLevel::<f64>::new(Some(tracker), Polarity::Rising, range, rate);
/// let mut baseline = level.memory();
/// // rest has drifted to 0.95 V: the baseline gives way until that is the level again
/// let above = (0..2000).map(|_| level.step(&mut baseline, 0.95, 0.0)).last();
/// assert!((above.unwrap() - 1.0).abs() < 1e-6);
/// # Ok::<(), DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestLevel<T> {
    /// The resting signal, times the sign of its polarity.
    pub level: T,
    /// Share of the excess that is taken up in a sample; zero: nothing is followed.
    pub pull: T,
    /// What the baseline rises by in a sample without excess.
    pub leak: T,
    /// Share of a sample in the running average of the excess.
    pub average: T,
    /// The furthest that the baseline goes.
    pub furthest: T,
    /// The most that an excess counts for.
    pub most: T,
}

/// Where the baseline is, and how far the signal has been above rest of late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baseline<T> {
    at: T,
    excess: T,
}

impl<T: Real> RestLevel<T> {
    /// The tracker of a calibration with these parts; without one, a signal passes as it is.
    pub fn new(
        rest: Option<RestTracker>,
        polarity: Polarity,
        signal_range: Range,
        sample_rate: SampleRate,
    ) -> Self {
        let Some(rest) = rest else {
            let zero = T::zero();
            let (level, pull, leak, average, furthest, most) = (zero, zero, zero, zero, zero, zero);
            return Self { level, pull, leak, average, furthest, most };
        };
        let period_s = sample_rate.period_s();
        Self {
            level: T::from_f64(polarity.sign() * rest.level),
            pull: T::from_f64((period_s / rest.catch_up_s).min(1.0)),
            leak: T::from_f64(rest.leak * period_s),
            average: T::from_f64(lag_share(period_s, RestTracker::AVERAGE_S)),
            furthest: T::from_f64(RestTracker::FURTHEST * signal_range.span()),
            most: T::from_f64(RestTracker::MOST_EXCESS * signal_range.span()),
        }
    }

    /// Whether a baseline is followed at all.
    #[inline(always)]
    pub fn follows(&self) -> bool {
        self.pull != T::zero()
    }

    /// Moves the baseline for a signal times the sign of its polarity, where memory
    /// moves the resting level by `shift`; the signal above the baseline.
    #[inline(always)]
    pub fn step(&self, baseline: &mut Baseline<T>, signal: T, shift: T) -> T {
        if !self.follows() {
            return signal;
        }
        let excess = signal - baseline.at - (self.level + shift);
        let held = excess.max(-self.most).min(self.most);
        baseline.excess = lag(baseline.excess, held, self.average);
        let wanted =
            if baseline.excess < T::zero() { self.pull * baseline.excess } else { self.leak };
        let before = baseline.at;
        baseline.at = (before + wanted).max(-self.furthest).min(self.furthest);
        // the average is of what lies above the baseline as it is now
        baseline.excess = baseline.excess - (baseline.at - before);
        signal - baseline.at
    }
}

impl<T: Real> Design for RestLevel<T> {
    type Memory = Baseline<T>;

    fn memory(&self) -> Baseline<T> {
        Baseline { at: T::zero(), excess: T::zero() }
    }
}
