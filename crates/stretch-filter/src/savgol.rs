//! Causal Savitzky-Golay filters whose shape is part of the type.

use crate::{Cost, MAX_SG_DEGREE, NamedRate, fir, gram, named::savitzky_golay, sample};
use stretch_core::{Design, DesignError, RateEstimator, Real, SampleRate, Stage};

/// Causal Savitzky-Golay filter: the `ORDER`-th derivative of the least-squares polynomial of
/// degree `DEGREE` through the newest `WINDOW` samples, evaluated `DELAY` samples before the
/// newest.
///
/// ```text
/// y[n] = sum over j = 0 .. WINDOW-1 of taps[j] x[n-j]
/// ```
///
/// Use it through [`SgRate`] (`ORDER` 1) and [`SgSmooth`] (`ORDER` 0). The
/// output is in the sample's unit per second^`ORDER`.
///
/// **Choosing.** A longer `WINDOW` lowers [`noise_gain`](Self::noise_gain), but reacts later when
/// the signal curves. A higher `DEGREE` follows curved signals, but raises the noise gain. A larger
/// `DELAY`, up to the middle of the window, lowers the noise gain.
///
/// **Samples** that are NaN or beyond [`LARGEST_SAMPLE`](crate::LARGEST_SAMPLE) give `None` and
/// leave the memory unchanged. The window then lacks a sample. Treat this as a gap: take a fresh
/// memory, or step the last good sample once more.
///
/// **An invalid shape does not compile**: `WINDOW` must exceed `DEGREE`, `ORDER` must not exceed
/// `DEGREE`, `DELAY` must be less than `WINDOW`, and `DEGREE` must not exceed [`MAX_SG_DEGREE`].
///
/// ```compile_fail
/// use stretch_core::SampleRate;
/// use stretch_filter::SgRate;
/// // Two samples do not determine a parabola.
/// let _ = SgRate::<f64, 2, 2>::new(SampleRate::new(100.0).unwrap());
/// ```
/// ```compile_fail
/// use stretch_core::SampleRate;
/// use stretch_filter::SgRate;
/// // The slope of a constant is always zero.
/// let _ = SgRate::<f64, 11, 0>::new(SampleRate::new(100.0).unwrap());
/// ```
/// ```compile_fail
/// use stretch_core::SampleRate;
/// use stretch_filter::SgRate;
/// // Eleven samples before the newest is outside a window of eleven.
/// let _ = SgRate::<f64, 11, 2, 11>::new(SampleRate::new(100.0).unwrap());
/// ```
///
/// Source: Savitzky and Golay 1964, doi:10.1021/ac60214a047; taps by Gorry
/// 1990, doi:10.1021/ac00205a007.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SavitzkyGolay<
    T,
    const ORDER: usize,
    const WINDOW: usize,
    const DEGREE: usize,
    const DELAY: usize = 0,
> {
    taps: [T; WINDOW],
    sample_rate: SampleRate,
}

/// Causal estimator of the rate of a signal: a [`SavitzkyGolay`] of derivative order 1.
///
/// ```
/// use stretch_core::{Runner, SampleRate};
/// use stretch_filter::SgRate;
///
/// let design = SgRate::<f64, 11, 2>::new(SampleRate::new(100.0).unwrap()).unwrap();
/// let mut rate = Runner::new(design);
/// let mut last = None;
/// for n in 0..20 {
///     let t = n as f64 * 0.01;
///     last = rate.step(3.0 * t * t); // exact on a parabola: x' = 6 t
///     assert_eq!(last.is_some(), n >= 10);
/// }
/// approx::assert_abs_diff_eq!(last.unwrap(), 6.0 * 0.19, epsilon = 1e-12);
/// approx::assert_abs_diff_eq!(design.delay_s(), 0.0, epsilon = 1e-12);
/// ```
pub type SgRate<T, const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0> =
    SavitzkyGolay<T, 1, WINDOW, DEGREE, DELAY>;

/// Causal estimator of the smoothed value of a signal: a [`SavitzkyGolay`] of derivative order 0.
///
/// ```
/// use stretch_core::{Runner, SampleRate};
/// use stretch_filter::SgSmooth;
///
/// let design = SgSmooth::<f64, 5, 1, 2>::new(SampleRate::new(100.0).unwrap()).unwrap();
/// let mut mean = Runner::new(design); // degree 1 in the middle: the mean of five
/// let out: Vec<_> = [1.0, 2.0, 3.0, 4.0, 10.0].iter().map(|&x| mean.step(x)).collect();
/// assert_eq!(out[3], None);
/// approx::assert_abs_diff_eq!(out[4].unwrap(), 4.0_f64, epsilon = 1e-14);
/// ```
pub type SgSmooth<T, const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0> =
    SavitzkyGolay<T, 0, WINDOW, DEGREE, DELAY>;

/// State of a [`SavitzkyGolay`] of `WINDOW` taps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SgMemory<T, const WINDOW: usize> {
    state: [T; WINDOW],
    remaining: usize,
}

impl<T, const WINDOW: usize> SgMemory<T, WINDOW> {
    /// Returns the number of further samples that give `None` before the window is full.
    #[inline]
    pub fn remaining(&self) -> usize {
        self.remaining
    }
}

impl<T: Real, const WINDOW: usize> SgMemory<T, WINDOW> {
    pub(crate) fn empty(remaining: usize) -> Self {
        Self { state: [T::zero(); WINDOW], remaining }
    }

    #[inline(always)]
    pub(crate) fn step(&mut self, taps: &[T], x: T) -> Option<T> {
        if !sample::usable(x) {
            return None;
        }
        let y = fir::step(taps, &mut self.state, x);
        if self.remaining > 0 {
            self.remaining -= 1;
            return None;
        }
        Some(y)
    }
}

impl<T: Real, const ORDER: usize, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    SavitzkyGolay<T, ORDER, WINDOW, DEGREE, DELAY>
{
    const SHAPE: () = {
        assert!(WINDOW > DEGREE, "WINDOW must exceed DEGREE: too few samples for the polynomial");
        assert!(ORDER <= DEGREE, "a derivative above DEGREE is always zero");
        assert!(DELAY < WINDOW, "DELAY must lie inside the window");
        assert!(DEGREE <= MAX_SG_DEGREE, "DEGREE exceeds MAX_SG_DEGREE");
    };

    /// Arithmetic and memory of one step.
    pub const COST: Cost = Cost::new(WINDOW, WINDOW - 1, WINDOW);

    /// Computes the design for samples at `sample_rate`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] for a sample rate outside
    /// [`MIN_SAMPLE_RATE_HZ`](crate::MIN_SAMPLE_RATE_HZ) ..=
    /// [`MAX_SAMPLE_RATE_HZ`](crate::MAX_SAMPLE_RATE_HZ).
    pub fn new(sample_rate: SampleRate) -> Result<Self, DesignError> {
        let () = Self::SHAPE;
        let sample_rate = sample::checked_rate(sample_rate)?;
        let scale: f64 = (0..ORDER).map(|_| sample_rate.hz()).product();
        let mut taps = [T::zero(); WINDOW];
        gram::taps_into(WINDOW, DEGREE, ORDER, DELAY, scale, |lag, tap| {
            taps[lag] = T::from_f64(tap);
        });
        Ok(Self { taps, sample_rate })
    }

    /// Returns the taps, newest sample first, in 1/s^`ORDER`.
    pub fn taps(&self) -> &[T; WINDOW] {
        &self.taps
    }

    /// Returns the sample rate of the design.
    pub fn sample_rate(&self) -> SampleRate {
        self.sample_rate
    }

    /// Returns the standard deviation of the output for white noise of standard deviation 1, in
    /// 1/s^`ORDER`. It is the square root of the sum of the squared taps.
    pub fn noise_gain(&self) -> f64 {
        fir::noise_gain(&self.taps)
    }

    /// Returns the delay of the output for slow signals, in seconds.
    ///
    /// It is `DELAY` samples if `DEGREE` exceeds `ORDER`. If `DEGREE` equals `ORDER`, the
    /// derivative of the fit is the same everywhere in the window, and the delay is half the window
    /// for any `DELAY`.
    pub fn delay_s(&self) -> f64 {
        let unit: f64 = (0..ORDER).map(|_| self.sample_rate.period_s()).product();
        fir::delay_samples(&self.taps, ORDER, unit) * self.sample_rate.period_s()
    }

    /// Returns the steady state for the constant input `x`: no warm-up and no transient.
    ///
    /// If `x` is NaN or beyond [`LARGEST_SAMPLE`](crate::LARGEST_SAMPLE), the result is a memory
    /// that has seen no sample.
    pub fn settled_at(&self, x: T) -> SgMemory<T, WINDOW> {
        let mut memory = self.memory();
        if sample::usable(x) {
            fir::settle(&self.taps, &mut memory.state, x);
            memory.remaining = 0;
        }
        memory
    }
}

impl<T: Real, const ORDER: usize, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    Design for SavitzkyGolay<T, ORDER, WINDOW, DEGREE, DELAY>
{
    type Memory = SgMemory<T, WINDOW>;

    fn memory(&self) -> SgMemory<T, WINDOW> {
        SgMemory::empty(WINDOW - 1)
    }
}

/// Only the first derivative is a rate.
impl<T: Real, const ORDER: usize, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    NamedRate for SavitzkyGolay<T, ORDER, WINDOW, DEGREE, DELAY>
{
    fn named(&self) -> Option<(RateEstimator, SampleRate)> {
        savitzky_golay(WINDOW, DEGREE, DELAY, self.sample_rate).filter(|_| ORDER == 1)
    }
}

impl<T: Real, const ORDER: usize, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    Stage<T> for SavitzkyGolay<T, ORDER, WINDOW, DEGREE, DELAY>
{
    type Out = Option<T>;

    #[inline]
    fn step(&self, memory: &mut SgMemory<T, WINDOW>, x: T) -> Option<T> {
        memory.step(&self.taps, x)
    }
}
