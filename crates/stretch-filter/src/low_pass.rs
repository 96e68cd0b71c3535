//! Butterworth low-pass filters.

use crate::{Biquad, BiquadMemory, BiquadSpec, Cost, sample};
use core::f64::consts::PI;
use stretch_core::{Design, DesignError, Hertz, Real, SampleRate, Stage};

/// The highest order of a [`LowPass`].
pub const MAX_ORDER: usize = 8;

/// Specification of a low-pass filter.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LowPassSpec {
    /// Frequency at which the gain is 1/sqrt(2) (-3 dB): above zero and below half the sample rate.
    pub cutoff: Hertz,
    /// The sample rate of the stream.
    pub sample_rate: SampleRate,
}

impl LowPassSpec {
    /// Designs the Butterworth low-pass filter of `ORDER` with this cutoff.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming `cutoff_hz` or `sample_rate_hz`. See [`LowPass`] for the
    /// lowest cutoff of each sample type.
    pub fn design<T: Real, const ORDER: usize>(self) -> Result<LowPass<T, ORDER>, DesignError> {
        LowPass::new(self)
    }

    /// Returns tan(pi fc / fs), the prewarped cutoff.
    pub(crate) fn warped(&self) -> f64 {
        libm::tan(PI * self.cutoff.0 * self.sample_rate.period_s())
    }

    /// Returns the specification if its numbers allow a design.
    pub(crate) fn checked(self) -> Result<Self, DesignError> {
        sample::checked_rate(self.sample_rate)?;
        let cutoff = self.cutoff.0;
        let holds = cutoff > 0.0 && cutoff < 0.5 * self.sample_rate.hz();
        DesignError::check("cutoff_hz", cutoff, holds)?;
        Ok(self)
    }

    /// Designs a second-order section with unit gain at frequency zero, whose analogue
    /// prototype is 1 / (s^2 + `inverse_q` s + 1).
    pub(crate) fn section<T: Real>(&self, inverse_q: f64) -> Result<Biquad<T>, DesignError> {
        let k = self.warped();
        let norm = 1.0 / (1.0 + k * inverse_q + k * k);
        let a1 = 2.0 * (k * k - 1.0) * norm;
        let a2 = (1.0 - k * inverse_q + k * k) * norm;
        self.with_poles::<T>(a1, a2, 4.0 * k * k * norm, 2)
    }

    /// Designs the first-order section whose analogue prototype is 1 / (s + 1).
    fn first_order<T: Real>(&self) -> Result<Biquad<T>, DesignError> {
        let k = self.warped();
        self.with_poles::<T>((k - 1.0) / (k + 1.0), 0.0, 2.0 * k / (k + 1.0), 1)
    }

    /// Creates a section from pole coefficients. The pole coefficients are rounded to `T` first, and the numerator is
    /// computed from the rounded values, so that a constant passes with gain 1.
    fn with_poles<T: Real>(
        &self,
        a1: f64,
        a2: f64,
        exact_sum: f64,
        order: usize,
    ) -> Result<Biquad<T>, DesignError> {
        let [ra1, ra2] = [a1, a2].map(|a| T::from_f64(a).as_f64());
        let sum = 1.0 + ra1 + ra2;
        // 1 + a1 + a2 is nearly proportional to cutoff^order. Therefore the relative change of this sum by rounding is
        // a bound for the relative change of the cutoff.
        let kept = (sum / exact_sum - 1.0).abs() <= 0.01;
        DesignError::check("cutoff_hz", self.cutoff.0, kept)?;
        let (b0, b1, b2) = if order == 2 {
            (0.25 * sum, 0.5 * sum, 0.25 * sum)
        } else {
            (0.5 * sum, 0.5 * sum, 0.0)
        };
        let refused = DesignError::OutOfRange { field: "cutoff_hz", value: self.cutoff.0 };
        Biquad::new(BiquadSpec { b0, b1, b2, a1: ra1, a2: ra2 }).map_err(|_| refused)
    }
}

/// A Butterworth low-pass filter of order 1 ..= 8: a cascade of [`Biquad`]s.
///
/// ```text
/// |H(f)|^2 = 1 / (1 + (tan(pi f/fs) / tan(pi fc/fs))^(2 ORDER))
/// ```
///
/// It is designed by the bilinear transform with prewarping, so that the gain at the cutoff is
/// exactly 1/sqrt(2). A constant passes with gain 1. The filter starts in the steady state for the
/// first valid sample, so there is no start-up transient from zero. A sample that is NaN or beyond
/// `LARGEST_SAMPLE` gives NaN and leaves the memory unchanged.
///
/// **Limits.** Rounding the poles to `T` moves the cutoff. A design whose cutoff would move by more
/// than about 1 % is refused. This excludes cutoffs below roughly fs/1500 in `f32`, and below
/// fs/3e7 in `f64`.
///
/// ```
/// use stretch_core::{Hertz, Runner, SampleRate};
/// use stretch_filter::LowPassSpec;
///
/// let spec = LowPassSpec { cutoff: Hertz(5.0), sample_rate: SampleRate::new(100.0).unwrap() };
/// let mut smooth = Runner::new(spec.design::<f64, 2>().unwrap());
/// approx::assert_abs_diff_eq!(smooth.step(0.7), 0.7, epsilon = 1e-15);
/// approx::assert_abs_diff_eq!(smooth.design().delay_s(), 0.0446, epsilon = 1e-4);
/// ```
/// ```compile_fail
/// # use stretch_core::{Hertz, SampleRate};
/// # use stretch_filter::LowPassSpec;
/// # let spec = LowPassSpec { cutoff: Hertz(5.0), sample_rate: SampleRate::new(100.0).unwrap() };
/// let _ = spec.design::<f64, 9>(); // no more than order 8
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass<T, const ORDER: usize> {
    sections: [Biquad<T>; MAX_ORDER / 2],
    spec: LowPassSpec,
}

/// State of a [`LowPass`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LowPassMemory<T> {
    sections: [BiquadMemory<T>; MAX_ORDER / 2],
    started: bool,
}

impl<T: Real, const ORDER: usize> LowPass<T, ORDER> {
    const SHAPE: () = assert!(ORDER >= 1 && ORDER <= MAX_ORDER, "ORDER must be 1 ..= 8");
    const SECTIONS: usize = ORDER.div_ceil(2);

    /// Arithmetic and memory of one step.
    pub const COST: Cost = Cost::new(5 * Self::SECTIONS, 4 * Self::SECTIONS, 2 * Self::SECTIONS);

    /// Designs the filter for `spec`, like [`LowPassSpec::design`].
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming `cutoff_hz` or `sample_rate_hz`.
    pub fn new(spec: LowPassSpec) -> Result<Self, DesignError> {
        let () = Self::SHAPE;
        let spec = spec.checked()?;
        let identity = BiquadSpec { b0: 1.0, b1: 0.0, b2: 0.0, a1: 0.0, a2: 0.0 };
        let mut sections = [Biquad::new(identity)?; MAX_ORDER / 2];
        let odd = ORDER % 2;
        if odd == 1 {
            sections[0] = spec.first_order()?;
        }
        // The most damped pair comes first, which gives the least overshoot inside the cascade.
        for (i, section) in sections[odd..Self::SECTIONS].iter_mut().enumerate() {
            let pair = ORDER / 2 - 1 - i;
            let angle = PI * (2 * pair + 1) as f64 / (2 * ORDER) as f64;
            *section = spec.section(2.0 * libm::sin(angle))?;
        }
        Ok(Self { sections, spec })
    }

    /// Returns the sections in the order in which they run.
    pub fn sections(&self) -> &[Biquad<T>] {
        &self.sections[..Self::SECTIONS]
    }

    /// Returns the specification of the filter.
    pub fn spec(&self) -> LowPassSpec {
        self.spec
    }

    /// Returns the delay of slow signals in seconds: the group delay at frequency zero.
    pub fn delay_s(&self) -> f64 {
        let samples: f64 = self.sections().iter().map(Biquad::delay_samples).sum();
        samples * self.spec.sample_rate.period_s()
    }

    /// Returns the standard deviation of the output for white input noise of standard deviation 1.
    pub fn noise_gain(&self) -> f64 {
        libm::sqrt(noise_power(self.spec.warped(), ORDER, |_| 1.0))
    }

    /// Returns the steady state for the constant input `x`, from which this input gives no
    /// transient.
    ///
    /// If `x` is NaN or beyond `LARGEST_SAMPLE`, the result is a memory that has seen no sample.
    pub fn settled_at(&self, x: T) -> LowPassMemory<T> {
        let mut memory = LowPassMemory::default();
        if sample::usable(x) {
            for (section, memory) in self.sections.iter().zip(&mut memory.sections) {
                *memory = section.settled_at(x);
            }
            memory.started = true;
        }
        memory
    }
}

/// Returns the mean of `extra(u) |H|^2` over all frequencies up to half the sample rate,
/// where H is the Butterworth filter with prewarped cutoff `k` and u = tan(pi f/fs).
///
/// ```text
/// (2/pi) integral over u = 0 .. inf of extra(u) / ((1 + u^2) (1 + (u/k)^(2 order))) du
/// ```
///
/// With the substitution u = k e^s the trapezoidal rule converges geometrically, because the
/// integrand is analytic in a strip around the real axis.
pub(crate) fn noise_power(k: f64, order: usize, extra: impl Fn(f64) -> f64) -> f64 {
    const STEP: f64 = 1.0 / 32.0;
    let mut sum = 0.0;
    // At the low end of the sum e^s is below 1e-18, at the high end |H|^2 is.
    for i in -1344..=1344 {
        let u = k * libm::exp(f64::from(i) * STEP);
        let filter = 1.0 / (1.0 + libm::exp(2.0 * order as f64 * f64::from(i) * STEP));
        sum += u * filter * extra(u) / (1.0 + u * u);
    }
    2.0 / PI * STEP * sum
}

impl<T: Real, const ORDER: usize> Design for LowPass<T, ORDER> {
    type Memory = LowPassMemory<T>;

    fn memory(&self) -> LowPassMemory<T> {
        LowPassMemory::default()
    }
}

impl<T: Real, const ORDER: usize> Stage<T> for LowPass<T, ORDER> {
    type Out = T;

    #[inline]
    fn step(&self, memory: &mut LowPassMemory<T>, x: T) -> T {
        if !sample::usable(x) {
            return T::nan();
        }
        if !memory.started {
            *memory = self.settled_at(x);
        }
        let mut y = x;
        for i in 0..Self::SECTIONS {
            y = self.sections[i].pass(&mut memory.sections[i], y);
        }
        y
    }
}
