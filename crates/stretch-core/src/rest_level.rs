//! Tracking of the resting signal, sample by sample.

use crate::{
    Design, Polarity, Range, Real, RestTracker, SampleRate,
    arithmetic::{lag, lag_share},
};

/// A [`RestTracker`] whose rates are converted to steps per sample.
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
    /// Resting signal times the sign of the polarity.
    pub level: T,
    /// Share of the excess (signal minus baseline minus level) by which the baseline moves in one sample. Zero
    /// means that no drift is followed.
    pub pull: T,
    /// Rise of the baseline in one sample while the average excess is not negative.
    pub leak: T,
    /// Weight of one sample in the running average of the excess.
    pub average: T,
    /// Largest magnitude of the baseline.
    pub furthest: T,
    /// Largest magnitude with which the excess of one sample enters the average.
    pub most: T,
}

/// The state of a `RestLevel`: the baseline and the running average of the excess.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baseline<T> {
    at: T,
    excess: T,
}

impl<T: Real> RestLevel<T> {
    /// Creates the tracker from these parts of a calibration. If `rest` is `None`, the signal passes unchanged.
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

    /// Returns whether drift is followed at all.
    #[inline(always)]
    pub fn follows(&self) -> bool {
        self.pull != T::zero()
    }

    /// Updates the baseline with a sample and returns the sample minus the baseline. `signal` is the signal times
    /// the sign of the polarity. `shift` is the amount by which the model's memory shifts the resting level.
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
        // the average refers to the baseline, so it changes when the baseline moves
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
