//! A steady-state Kalman filter (alpha-beta tracker) for a value and its rate.

use crate::{Cost, sample};
use stretch_core::{Design, DesignError, Real, SampleRate, Stage};

/// Specification of a tracker: the signal's acceleration relative to the noise, and the sample
/// rate.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrackerSpec {
    /// lambda = sigma_acceleration T^2 / sigma_measurement, from 1e-6 to 1e6, dimensionless, where
    /// T is the sample period. It compares the motion due to the acceleration in one sample with
    /// the noise. A small index gives smooth but delayed estimates, a large index gives fast but
    /// noisy ones. With a typical acceleration of the signal in V/s^2 and the standard deviation of its noise in V, the
    /// equation gives the index: 30 V/s^2 at 100 Hz (T = 0.01 s) and 0.003 V give 30 0.01^2 / 0.003 = 1.
    pub tracking_index: f64,
    /// The sample rate of the stream.
    pub sample_rate: SampleRate,
}

/// An alpha-beta filter for value and rate, with the gains of the steady-state Kalman filter for a
/// signal whose acceleration is white noise.
///
/// ```text
/// predicted = value + T rate;   surprise = x - predicted
/// value = predicted + alpha surprise;   rate = rate + beta/T surprise
/// ```
///
/// With s = 2 lambda/(lambda + sqrt(lambda^2 + 8 lambda)) the gains are alpha = s (2 - s) and beta
/// = 2 s^2 (Kalata 1984, doi:10.1109/TAES.1984.310438, rewritten to avoid cancellation). The
/// estimates are unbiased on a ramp. The filter starts from its first two samples and gives `None`
/// until their effect has decayed to 1 %. A sample that is NaN or beyond `LARGEST_SAMPLE` gives
/// `None` and leaves the memory unchanged. The stream then lacks a sample, so treat it as a gap.
///
/// ```
/// use stretch_core::{Runner, SampleRate};
/// use stretch_filter::{Tracker, TrackerSpec};
///
/// let sample_rate = SampleRate::new(100.0).unwrap();
/// let design = Tracker::<f64>::new(TrackerSpec { tracking_index: 0.1, sample_rate }).unwrap();
/// let mut tracker = Runner::new(design);
/// let last = (0..100).filter_map(|n| tracker.step(0.02 * n as f64)).last().unwrap();
/// approx::assert_abs_diff_eq!(last.value, 1.98, epsilon = 1e-12);
/// approx::assert_abs_diff_eq!(last.rate, 2.0, epsilon = 1e-10);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tracker<T> {
    alpha: T,
    beta: T,
    sample_hz: T,
    spec: TrackerSpec,
    warm_up: u32,
}

/// Output of a [`Tracker`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Track<T> {
    /// The value, in the sample's unit.
    pub value: T,
    /// Its rate, in the sample's unit per second.
    pub rate: T,
}

/// State of a [`Tracker`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerMemory<T> {
    value: T,
    /// Change per sample.
    change: T,
    seen: u8,
    remaining: u32,
}

impl<T> TrackerMemory<T> {
    /// Returns the number of further samples that give `None` before the tracker has settled.
    pub fn remaining(&self) -> usize {
        self.remaining as usize
    }
}

impl<T: Real> Tracker<T> {
    /// Arithmetic and memory of one step.
    pub const COST: Cost = Cost::new(3, 4, 2);

    /// Designs the tracker for `spec`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming `tracking_index` or `sample_rate_hz`.
    pub fn new(spec: TrackerSpec) -> Result<Self, DesignError> {
        let sample_rate = sample::checked_rate(spec.sample_rate)?;
        let lambda = spec.tracking_index;
        DesignError::check("tracking_index", lambda, (1e-6..=1e6).contains(&lambda))?;
        let s = 2.0 * lambda / (lambda + libm::sqrt(lambda * (lambda + 8.0)));
        let (alpha, beta) = (s * (2.0 - s), 2.0 * s * s);
        Ok(Self {
            alpha: T::from_f64(alpha),
            beta: T::from_f64(beta),
            sample_hz: T::from_f64(sample_rate.hz()),
            spec,
            warm_up: sample::settling(pole_radius(alpha, beta)),
        })
    }

    /// Returns the specification of the tracker.
    pub fn spec(&self) -> TrackerSpec {
        self.spec
    }

    /// Returns the gain of the value, rounded to `T`.
    pub fn alpha(&self) -> T {
        self.alpha
    }

    /// Returns the gain of the change per sample, rounded to `T`.
    pub fn beta(&self) -> T {
        self.beta
    }

    /// Returns the number of samples that give `None` at the start.
    pub fn warm_up(&self) -> usize {
        self.warm_up as usize
    }

    /// Returns the delay of the rate for slowly curving signals, in seconds: T (2 alpha - beta)/(2
    /// beta). The value has no delay on a ramp.
    pub fn delay_s(&self) -> f64 {
        let (alpha, beta) = (self.alpha.as_f64(), self.beta.as_f64());
        (2.0 * alpha - beta) / (2.0 * beta) * self.spec.sample_rate.period_s()
    }

    /// Returns the standard deviation of the rate for white noise of standard deviation 1, in 1/s.
    pub fn noise_gain(&self) -> f64 {
        let (alpha, beta) = (self.alpha.as_f64(), self.beta.as_f64());
        let power = 2.0 * beta * beta / (alpha * (4.0 - 2.0 * alpha - beta));
        libm::sqrt(power) * self.spec.sample_rate.hz()
    }

    /// Returns the standard deviation of the value for white noise of standard deviation 1.
    pub fn value_noise_gain(&self) -> f64 {
        let (alpha, beta) = (self.alpha.as_f64(), self.beta.as_f64());
        let power = 2.0 * alpha * alpha + beta * (2.0 - 3.0 * alpha);
        libm::sqrt(power / (alpha * (4.0 - 2.0 * alpha - beta)))
    }
}

/// Returns the larger magnitude of the roots of z^2 - (2 - alpha - beta) z + 1 - alpha.
fn pole_radius(alpha: f64, beta: f64) -> f64 {
    let half = (2.0 - alpha - beta) / 2.0;
    let square = half * half - (1.0 - alpha);
    if square < 0.0 { libm::sqrt(1.0 - alpha) } else { half.abs() + libm::sqrt(square) }
}

impl<T: Real> Design for Tracker<T> {
    type Memory = TrackerMemory<T>;

    fn memory(&self) -> TrackerMemory<T> {
        TrackerMemory { value: T::zero(), change: T::zero(), seen: 0, remaining: self.warm_up }
    }
}

impl<T: Real> Stage<T> for Tracker<T> {
    type Out = Option<Track<T>>;

    #[inline]
    fn step(&self, memory: &mut TrackerMemory<T>, x: T) -> Option<Track<T>> {
        if !sample::usable(x) {
            return None;
        }
        if memory.seen < 2 {
            // The first sample gives the value, the second the rate as well.
            memory.change = if memory.seen == 0 { T::zero() } else { x - memory.value };
            memory.value = x;
            memory.seen += 1;
        } else {
            let predicted = memory.value + memory.change;
            let surprise = x - predicted;
            memory.value = predicted + self.alpha * surprise;
            memory.change = memory.change + self.beta * surprise;
        }
        if memory.remaining > 0 {
            memory.remaining -= 1;
            return None;
        }
        Some(Track { value: memory.value, rate: memory.change * self.sample_hz })
    }
}
