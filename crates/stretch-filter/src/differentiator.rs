//! A band-limited differentiator.

use crate::low_pass::noise_power;
use crate::{Biquad, BiquadMemory, Cost, LowPassSpec, NamedRate, sample};
use core::f64::consts::SQRT_2;
use stretch_core::{Design, DesignError, RateEstimator, Real, SampleRate, Stage};

/// Estimator of a signal's rate: a first difference in series with a second-order Butterworth
/// low-pass filter.
///
/// ```text
/// rate[n] = fs (H(z) (x[n] - x[n-1])),   H: Butterworth, order 2, at the cutoff
/// ```
///
/// The difference comes first because it is exact or nearly exact for a slow signal, and because it
/// removes a constant offset before any rounding. The output is in the sample's unit per second. On
/// a ramp it is exact after settling. If the signal curves, it is late by
/// [`delay_s`](Self::delay_s).
///
/// The output is `None` for the first [`warm_up`](Self::warm_up) samples, until the filter has
/// settled to 1 %. A sample that is NaN or beyond `LARGEST_SAMPLE` gives `None` and leaves the
/// memory unchanged. The stream then lacks a sample, so treat it as a gap.
///
/// ```
/// use stretch_core::{Hertz, Runner, SampleRate};
/// use stretch_filter::{Differentiator, LowPassSpec};
///
/// let spec = LowPassSpec { cutoff: Hertz(5.0), sample_rate: SampleRate::new(100.0).unwrap() };
/// let mut rate = Runner::new(Differentiator::<f64>::new(spec).unwrap());
/// let ramp = (0..200).filter_map(|n| rate.step(1.0 + 0.02 * n as f64)).last();
/// approx::assert_abs_diff_eq!(ramp.unwrap(), 2.0, epsilon = 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Differentiator<T> {
    low_pass: Biquad<T>,
    spec: LowPassSpec,
    warm_up: u32,
}

/// State of a [`Differentiator`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DifferentiatorMemory<T> {
    low_pass: BiquadMemory<T>,
    last: T,
    started: bool,
    remaining: u32,
}

impl<T> DifferentiatorMemory<T> {
    /// Returns the number of further samples that give `None` before the filter has settled.
    pub fn remaining(&self) -> usize {
        self.remaining as usize
    }
}

impl<T: Real> Differentiator<T> {
    /// Arithmetic and memory of one step.
    pub const COST: Cost = Cost::new(5, 5, 3);

    /// Creates the differentiator with the low-pass filter of `spec`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming `cutoff_hz` or `sample_rate_hz`.
    pub fn new(spec: LowPassSpec) -> Result<Self, DesignError> {
        let spec = spec.checked()?;
        let unit = spec.section::<T>(SQRT_2)?;
        let mut c = unit.spec();
        let warm_up = sample::settling(libm::sqrt(c.a2));
        let fs = spec.sample_rate.hz();
        (c.b0, c.b1, c.b2) = (c.b0 * fs, c.b1 * fs, c.b2 * fs);
        Ok(Self { low_pass: Biquad::new(c)?, spec, warm_up })
    }

    /// Returns the specification of the low-pass filter.
    pub fn spec(&self) -> LowPassSpec {
        self.spec
    }

    /// Returns the number of samples that give `None` at the start.
    pub fn warm_up(&self) -> usize {
        self.warm_up as usize
    }

    /// Returns the delay of the rate for slow signals, in seconds: the low-pass filter's group
    /// delay plus half a sample for the difference.
    pub fn delay_s(&self) -> f64 {
        (self.low_pass.delay_samples() + 0.5) * self.spec.sample_rate.period_s()
    }

    /// Returns the standard deviation of the rate for white noise of standard deviation 1, in 1/s.
    pub fn noise_gain(&self) -> f64 {
        // |1 - z^-1|^2 = 4 sin^2(pi f/fs)
        let power = noise_power(self.spec.warped(), 2, |u| 4.0 * u * u / (1.0 + u * u));
        libm::sqrt(power) * self.spec.sample_rate.hz()
    }
}

impl<T: Real> Design for Differentiator<T> {
    type Memory = DifferentiatorMemory<T>;

    fn memory(&self) -> DifferentiatorMemory<T> {
        DifferentiatorMemory {
            low_pass: BiquadMemory::default(),
            last: T::zero(),
            started: false,
            remaining: self.warm_up,
        }
    }
}

impl<T: Real> NamedRate for Differentiator<T> {
    fn named(&self) -> Option<(RateEstimator, SampleRate)> {
        let LowPassSpec { cutoff, sample_rate } = self.spec;
        Some((RateEstimator::Differentiator { cutoff_hz: cutoff.0 }, sample_rate))
    }
}

impl<T: Real> Stage<T> for Differentiator<T> {
    type Out = Option<T>;

    #[inline]
    fn step(&self, memory: &mut DifferentiatorMemory<T>, x: T) -> Option<T> {
        if !sample::usable(x) {
            return None;
        }
        if !memory.started {
            memory.started = true;
            memory.last = x;
        }
        let rate = self.low_pass.pass(&mut memory.low_pass, x - memory.last);
        memory.last = x;
        if memory.remaining > 0 {
            memory.remaining -= 1;
            return None;
        }
        Some(rate)
    }
}
