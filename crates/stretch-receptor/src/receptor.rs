//! The live pipeline: signal in, reading out, one sample at a time.

use stretch_core::{Branch, Calibration, Design, DesignError, Polarity, Real, Stage, Volts};
use stretch_filter::{FilterError, LARGEST_SAMPLE, RateFilter};

use crate::{Reading, Withheld, map::Map};

/// Missing samples in a row that are bridged by prediction; one more starts the
/// warm-up again.
pub const MAX_BRIDGED: u8 = 3;

/// A stretch receptor: a calibration, folded, with the rate estimator it was
/// fitted for.
///
/// A sample every period, in volts (or the unit of the calibration's signal):
/// 1. the rate of the signal, by the estimator `R`;
/// 2. the branch, from the sign of that rate outside the dead band;
/// 3. inputs outside the calibrated domain are clamped, and [`Reading::domain`] says so;
/// 4. the branch's surface gives the estimate in the reference's unit, its slope
///    times the rate of the signal gives the estimate's rate (the surface's own
///    dependence on the rate is left out of that derivative: it would need the
///    second derivative of a noisy signal).
///
/// **Warm-up.** Until the estimator answers there is no reading:
/// [`Withheld::Warming`]. The branch before the first movement is
/// [`Branch::Inflation`] unless [`ReceptorMemory::starting_on`] says otherwise.
///
/// **Missing samples.** Step a NaN (or any value that is not finite, or beyond
/// [`LARGEST_SAMPLE`]) for a sample that did not come: it is answered with [`Withheld::Missing`] and never enters
/// the memory. Up to [`MAX_BRIDGED`] in a row the estimator is fed the last
/// sample moved on by the last rate, so that one lost sample costs one reading
/// and not a warm-up. One more forgets the window; the branch is kept.
///
/// **Reset**: a fresh [`Design::memory`], which a
/// [`Runner`](stretch_core::Runner) does in `reset`.
///
/// ```
/// use stretch_core::{Runner, Volts, Design};
/// use stretch_receptor::{StretchReceptor, Withheld};
/// # let calibration = stretch_receptor::example_calibration();
///
/// let mut receptor = Runner::new(StretchReceptor::<f32>::new(&calibration)?);
/// let mut length_mm = f32::NAN;
/// for n in 0..100 {
///     let bridge_v = 1.3 + 0.004 * n as f32; // the muscle fills
///     match receptor.step(Volts(bridge_v)) {
///         Ok(reading) => length_mm = reading.length().0,
///         Err(withheld) => assert!(n < 10 && withheld == Withheld::Warming),
///     }
/// }
/// assert!(length_mm > 158.0 && length_mm < 161.0);
/// # Ok::<(), stretch_filter::FilterError>(())
/// ```
///
/// Source: paper sections 2.5 and 3.4. Cost: see the crate's front page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StretchReceptor<T, R = RateFilter<T>> {
    rate: R,
    map: Map<T>,
    /// A rate of the signal above it means the first branch, below `-dead_band` the other.
    dead_band: T,
    rising: Branch,
    period_s: T,
}

/// What a [`StretchReceptor`] remembers: the estimator's memory, the branch and
/// the last sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceptorMemory<T, M> {
    rate: M,
    branch: Branch,
    last: T,
    last_rate: T,
    missing: u8,
}

impl<T, M> ReceptorMemory<T, M> {
    /// The same memory, on another branch: for a stream known to begin contracted.
    #[must_use]
    pub fn starting_on(self, branch: Branch) -> Self {
        Self { branch, ..self }
    }

    /// The branch that the next sample begins on.
    pub fn branch(&self) -> Branch {
        self.branch
    }

    pub(crate) fn set_branch(&mut self, branch: Branch) {
        self.branch = branch;
    }
}

impl<T: Real, M> ReceptorMemory<T, M> {
    pub(crate) fn unseen(rate: M) -> Self {
        let (last, last_rate) = (T::nan(), T::zero());
        Self { rate, branch: Branch::Inflation, last, last_rate, missing: 0 }
    }

    /// A usable sample: its rate, once there is one.
    #[inline(always)]
    pub(crate) fn take<R>(&mut self, estimator: &R, signal: T) -> Option<T>
    where
        R: Stage<T, Out = Option<T>, Memory = M>,
    {
        self.missing = 0;
        self.last = signal;
        let rate = estimator.step(&mut self.rate, signal)?;
        self.last_rate = rate;
        Some(rate)
    }

    /// A missing sample: bridge a short gap, forget the window after a long one.
    #[cold]
    pub(crate) fn miss<R>(&mut self, estimator: &R, period_s: T, most: u8)
    where
        R: Stage<T, Out = Option<T>, Memory = M>,
    {
        self.missing = self.missing.saturating_add(1);
        let bridged = self.last + self.last_rate * period_s;
        if self.missing <= most && bridged.is_finite() {
            self.last = bridged;
            // only the window matters here: nothing is answered for this sample
            let _ = estimator.step(&mut self.rate, bridged);
        } else {
            *self = Self { branch: self.branch, missing: most, ..Self::unseen(estimator.memory()) };
        }
    }
}

impl<T: Real> StretchReceptor<T> {
    /// A receptor for `calibration`, with the rate estimator that it names.
    ///
    /// The estimator's shape is a run-time value here; where it is known to the
    /// compiler, [`with_rate`](Self::with_rate) takes an
    /// [`SgRate`](stretch_filter::SgRate) and is smaller and faster.
    ///
    /// # Errors
    /// [`FilterError`] when the estimator cannot run live or cannot be designed,
    /// or a coefficient leaves the range of `T`.
    pub fn new(calibration: &Calibration) -> Result<Self, FilterError> {
        let rate = RateFilter::new(calibration.rate_estimator, calibration.sample_rate_hz)?;
        Ok(Self::with_rate(calibration, rate)?)
    }
}

impl<T: Real, R> StretchReceptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator built for it.
    ///
    /// `rate` must be the estimator that [`CalibrationSpec::rate_estimator`]
    /// names, designed for the calibration's sample rate: a surface is only
    /// right with the estimator it was fitted on.
    ///
    /// [`CalibrationSpec::rate_estimator`]: stretch_core::CalibrationSpec::rate_estimator
    ///
    /// # Errors
    /// [`DesignError`] when a coefficient leaves the range of `T`.
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, DesignError> {
        Ok(Self {
            rate,
            map: Map::new(calibration)?,
            dead_band: T::from_f64(calibration.dead_band),
            rising: match calibration.polarity {
                Polarity::Rising => Branch::Inflation,
                Polarity::Falling => Branch::Deflation,
            },
            period_s: T::from_f64(calibration.sample_rate_hz.period_s()),
        })
    }

    /// The rate estimator.
    pub fn rate_design(&self) -> &R {
        &self.rate
    }

    /// The branch that a rate of the signal chooses.
    #[inline(always)]
    fn branch(&self, current: Branch, rate: T) -> Branch {
        let falling = match self.rising {
            Branch::Inflation => Branch::Deflation,
            Branch::Deflation => Branch::Inflation,
        };
        if rate > self.dead_band {
            self.rising
        } else if rate < -self.dead_band {
            falling
        } else {
            current
        }
    }
}

impl<T: Real, R: Design> Design for StretchReceptor<T, R> {
    type Memory = ReceptorMemory<T, R::Memory>;

    fn memory(&self) -> Self::Memory {
        ReceptorMemory::unseen(self.rate.memory())
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Stage<Volts<T>> for StretchReceptor<T, R> {
    type Out = Result<Reading<T>, Withheld>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, sample: Volts<T>) -> Self::Out {
        let signal = sample.0;
        // one comparison, false for NaN as well
        let usable = signal.abs() <= T::from_f64(LARGEST_SAMPLE);
        if !usable {
            memory.miss(&self.rate, self.period_s, MAX_BRIDGED);
            return Err(Withheld::Missing);
        }
        let Some(rate) = memory.take(&self.rate, signal) else {
            return Err(Withheld::Warming);
        };
        memory.branch = self.branch(memory.branch, rate);
        let point = self.map.at(memory.branch, rate, signal);
        Ok(Reading {
            estimate: point.estimate,
            rate: point.slope * rate,
            branch: memory.branch,
            domain: point.domain,
        })
    }
}
