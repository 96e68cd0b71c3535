//! Savitzky-Golay filters whose shape is chosen at run time.

use crate::{Cost, FilterError, MAX_SG_DEGREE, SgMemory, fir, gram, sample};
use stretch_core::{Design, DesignError, Real, SampleRate, Stage};

/// Number of outputs in one block of [`SgFilter::over_log`], chosen so that a block stays in the L1
/// cache.
const BLOCK: usize = 256;

/// The shape of a [`SgFilter`], all in samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SgShape {
    /// Samples in the fit of the polynomial.
    pub window: usize,
    /// Degree of the polynomial, below `window` and at most [`MAX_SG_DEGREE`].
    pub degree: usize,
    /// Derivative: 0 smooths, 1 gives the rate.
    pub order: usize,
    /// Number of samples before the newest at which the polynomial is evaluated.
    pub delay: usize,
}

impl SgShape {
    /// Creates the shape for the rate at the newest sample.
    pub fn rate(window: usize, degree: usize) -> Self {
        Self { window, degree, order: 1, delay: 0 }
    }

    /// Creates the shape for the rate in the middle of the window, for a log or for live use with
    /// that delay.
    ///
    /// For an even window the rate is evaluated at the sample just after the middle.
    pub fn centred_rate(window: usize, degree: usize) -> Self {
        Self { delay: window.saturating_sub(1) / 2, ..Self::rate(window, degree) }
    }

    fn checked(self, capacity: usize) -> Result<Self, DesignError> {
        let Self { window, degree, order, delay } = self;
        if window > capacity {
            return Err(DesignError::TooLarge { field: "window", asked: window, most: capacity });
        }
        if degree > MAX_SG_DEGREE {
            return Err(DesignError::TooLarge {
                field: "degree",
                asked: degree,
                most: MAX_SG_DEGREE,
            });
        }
        DesignError::check("window", window as f64, window > degree)?;
        DesignError::check("order", order as f64, order <= degree)?;
        DesignError::check("delay", delay as f64, delay < window)?;
        Ok(self)
    }
}

/// A [`SavitzkyGolay`](crate::SavitzkyGolay) whose shape is chosen at run time, with a window of up
/// to `CAP` samples.
///
/// It uses the same arithmetic in the same order as the type with a fixed shape, and gives the same
/// bits. It also works on whole logs: [`SgFilter::over_log`].
///
/// ```
/// use stretch_core::{Runner, SampleRate};
/// use stretch_filter::{SgFilter, SgShape};
///
/// let rate = SampleRate::new(100.0).unwrap();
/// let filter = SgFilter::<f64, 32>::new(SgShape::centred_rate(7, 3), rate).unwrap();
/// let log: Vec<f64> = (0..40).map(|n| (n as f64 * 0.01).powi(3)).collect();
/// let mut slope = vec![0.0; log.len()];
/// filter.over_log(&log, &mut slope).unwrap();
/// for (n, slope) in slope.iter().enumerate() {
///     let t = n as f64 * 0.01;
///     approx::assert_abs_diff_eq!(*slope, 3.0 * t * t, epsilon = 1e-12); // exact to both ends
/// }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SgFilter<T, const CAP: usize = 64> {
    taps: [T; CAP],
    shape: SgShape,
    sample_rate: SampleRate,
}

impl<T: Real, const CAP: usize> SgFilter<T, CAP> {
    /// Computes the design for samples at `sample_rate`.
    ///
    /// # Errors
    /// [`DesignError::TooLarge`] for a window above `CAP` or a degree above [`MAX_SG_DEGREE`];
    /// [`DesignError::OutOfRange`], which names the field, for a window that does not exceed the
    /// degree, an order above the degree, a delay outside the window, or a sample rate outside 1e-9
    /// ..= 1e9 Hz.
    pub fn new(shape: SgShape, sample_rate: SampleRate) -> Result<Self, DesignError> {
        let shape = shape.checked(CAP)?;
        let sample_rate = sample::checked_rate(sample_rate)?;
        let SgShape { window, degree, order, delay } = shape;
        let scale: f64 = (0..order).map(|_| sample_rate.hz()).product();
        let mut taps = [T::zero(); CAP];
        gram::taps_into(window, degree, order, delay, scale, |lag, tap| {
            taps[lag] = T::from_f64(tap);
        });
        Ok(Self { taps, shape, sample_rate })
    }

    /// Returns the taps, newest sample first, in 1/s^order.
    pub fn taps(&self) -> &[T] {
        &self.taps[..self.shape.window]
    }

    /// Returns the shape.
    pub fn shape(&self) -> SgShape {
        self.shape
    }

    /// Returns the standard deviation of the output for white input noise of standard deviation 1,
    /// in 1/s^order.
    pub fn noise_gain(&self) -> f64 {
        fir::noise_gain(self.taps())
    }

    /// Returns the delay of the live output for slow signals, in seconds.
    pub fn delay_s(&self) -> f64 {
        let period_s = self.sample_rate.period_s();
        let unit: f64 = (0..self.shape.order).map(|_| period_s).product();
        fir::delay_samples(self.taps(), self.shape.order, unit) * period_s
    }

    /// Returns the arithmetic and memory of one live step.
    pub fn cost(&self) -> Cost {
        Cost::new(self.shape.window, self.shape.window - 1, self.shape.window)
    }

    /// Applies the filter to a whole log, aligned: `out[i]` belongs to sample i.
    ///
    /// Inside the log `out[i]` uses samples up to i + `delay`. Near the ends, where the window does
    /// not fit, the polynomial of the first (or last) whole window is evaluated at the other
    /// samples of that window, as in `sgolayfilt` and SciPy's `mode="interp"`. The log is not
    /// padded.
    ///
    /// # Errors
    /// [`FilterError::LengthsDiffer`]; [`FilterError::TooShort`] for a log shorter than the window;
    /// [`FilterError::NotFinite`] for a sample that is NaN or beyond `LARGEST_SAMPLE`. `out` is
    /// then unchanged.
    pub fn over_log(&self, log: &[T], out: &mut [T]) -> Result<(), FilterError> {
        let SgShape { window, delay, .. } = self.shape;
        if log.len() != out.len() {
            return Err(FilterError::LengthsDiffer { log: log.len(), other: out.len() });
        }
        if log.len() < window {
            return Err(FilterError::TooShort { needed: window, got: log.len() });
        }
        if let Some(index) = log.iter().position(|&x| !sample::usable(x)) {
            return Err(FilterError::NotFinite { index });
        }
        let taps = self.taps();
        let before = window - 1 - delay;
        // The loop goes tap by tap over a block of outputs, so that it can be vectorised. The
        // oldest tap comes first, as in the live step, which gives the same bits.
        let inside = &mut out[before..log.len() - delay];
        for (index, block) in inside.chunks_mut(BLOCK).enumerate() {
            let start = index * BLOCK;
            block.fill(T::zero());
            for (k, &tap) in taps.iter().rev().enumerate() {
                for (y, &x) in block.iter_mut().zip(&log[start + k..]) {
                    *y = *y + tap * x;
                }
            }
        }
        let (head, tail) = (&log[..window], &log[log.len() - window..]);
        self.off_centre(head, &mut out[..before], 0);
        let start = log.len() - delay;
        self.off_centre(tail, &mut out[start..], window - delay);
        Ok(())
    }

    /// Fits one window and evaluates the polynomial at `first`, `first + 1`, ...
    fn off_centre(&self, samples: &[T], out: &mut [T], first: usize) {
        if out.is_empty() {
            return;
        }
        let SgShape { window, degree, order, .. } = self.shape;
        let half = (window as f64 - 1.0) / 2.0;
        let mut coefficients = [0.0; MAX_SG_DEGREE + 1];
        for (i, x) in samples.iter().enumerate() {
            let here = gram::basis(window, degree, 0, i as f64 - half);
            for (c, q) in coefficients.iter_mut().zip(&here) {
                *c += q * x.as_f64();
            }
        }
        let scale: f64 = (0..order).map(|_| self.sample_rate.hz()).product();
        for (k, y) in out.iter_mut().enumerate() {
            let at = gram::basis(window, degree, order, (first + k) as f64 - half);
            let value: f64 = coefficients.iter().zip(&at).map(|(c, q)| c * q).sum();
            *y = T::from_f64(value * scale);
        }
    }
}

impl<T: Real, const CAP: usize> Design for SgFilter<T, CAP> {
    type Memory = SgMemory<T, CAP>;

    fn memory(&self) -> SgMemory<T, CAP> {
        SgMemory::empty(self.shape.window - 1)
    }
}

impl<T: Real, const CAP: usize> Stage<T> for SgFilter<T, CAP> {
    type Out = Option<T>;

    #[inline]
    fn step(&self, memory: &mut SgMemory<T, CAP>, x: T) -> Option<T> {
        memory.step(self.taps(), x)
    }
}
