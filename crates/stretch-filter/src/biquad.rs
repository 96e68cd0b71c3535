//! A second-order filter section (biquad).

use crate::{Cost, sample};
use stretch_core::{Design, DesignError, Real, Stage};

/// Coefficients of a second-order section, in `f64` before they are rounded.
///
/// ```text
/// H(z) = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)
/// y[n] = b0 x[n] + b1 x[n-1] + b2 x[n-2] - a1 y[n-1] - a2 y[n-2]
/// ```
///
/// The signs are those of SciPy and MATLAB (`sos` rows with a0 = 1).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(missing_docs)]
pub struct BiquadSpec {
    pub b0: f64,
    pub b1: f64,
    pub b2: f64,
    pub a1: f64,
    pub a2: f64,
}

/// A stable second-order section in transposed direct form II.
///
/// ```text
/// y = b0 x + s1;   s1 = s2 + b1 x - a1 y;   s2 = b2 x - a2 y
/// ```
///
/// The coefficients never change. The state is in the [`BiquadMemory`]. A sample that is NaN or
/// beyond [`LARGEST_SAMPLE`](crate::LARGEST_SAMPLE) leaves the memory unchanged and gives NaN for
/// that one step.
///
/// ```
/// use stretch_core::{Runner, Stage};
/// use stretch_filter::{Biquad, BiquadSpec};
///
/// // The mean of two samples.
/// let spec = BiquadSpec { b0: 0.5, b1: 0.5, b2: 0.0, a1: 0.0, a2: 0.0 };
/// let mean = Biquad::<f64>::new(spec).unwrap();
/// let mut memory = mean.settled_at(1.0);
/// assert_eq!(mean.step(&mut memory, 1.0), 1.0); // no transient
/// assert_eq!(mean.step(&mut memory, 3.0), 2.0);
/// assert!(mean.step(&mut memory, f64::NAN).is_nan());
/// assert_eq!(mean.step(&mut memory, 3.0), 3.0); // as if the NaN never came
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Biquad<T> {
    b0: T,
    b1: T,
    b2: T,
    a1: T,
    a2: T,
}

/// State of a [`Biquad`]: two numbers.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BiquadMemory<T> {
    s1: T,
    s2: T,
}

impl<T: Real> Biquad<T> {
    /// Arithmetic and memory of one step.
    pub const COST: Cost = Cost::new(5, 4, 2);

    /// Creates a section with these coefficients.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming the coefficient: not finite, above
    /// 1e18 in magnitude, or poles on or outside the unit circle once rounded
    /// to `T` (|a2| < 1 and |a1| < 1 + a2 must hold).
    pub fn new(spec: BiquadSpec) -> Result<Self, DesignError> {
        let BiquadSpec { b0, b1, b2, a1, a2 } = spec;
        for (field, b) in [("b0", b0), ("b1", b1), ("b2", b2)] {
            DesignError::check(field, b, b.abs() <= sample::LARGEST_SAMPLE)?;
        }
        let [ra1, ra2] = [a1, a2].map(|a| T::from_f64(a).as_f64());
        DesignError::check("a2", a2, ra2.abs() < 1.0)?;
        DesignError::check("a1", a1, ra1.abs() < 1.0 + ra2)?;
        let [b0, b1, b2, a1, a2] = [b0, b1, b2, a1, a2].map(T::from_f64);
        Ok(Self { b0, b1, b2, a1, a2 })
    }

    /// Returns the coefficients in use, rounded to `T`.
    pub fn spec(&self) -> BiquadSpec {
        let [b0, b1, b2, a1, a2] =
            [self.b0, self.b1, self.b2, self.a1, self.a2].map(|c| c.as_f64());
        BiquadSpec { b0, b1, b2, a1, a2 }
    }

    /// Returns the gain for a constant input: H(1).
    pub fn dc_gain(&self) -> f64 {
        let c = self.spec();
        (c.b0 + c.b1 + c.b2) / (1.0 + c.a1 + c.a2)
    }

    /// Returns the group delay at frequency zero, in samples: the delay of a slow signal.
    ///
    /// Infinite or NaN for a section whose gain at frequency zero is 0.
    pub fn delay_samples(&self) -> f64 {
        let c = self.spec();
        (c.b1 + 2.0 * c.b2) / (c.b0 + c.b1 + c.b2) - (c.a1 + 2.0 * c.a2) / (1.0 + c.a1 + c.a2)
    }

    /// Returns the standard deviation of the output for white input noise of standard deviation 1.
    ///
    /// It is the square root of the energy of the impulse response, in closed form (Astrom,
    /// Introduction to Stochastic Control Theory, 1970, chapter 5).
    pub fn noise_gain(&self) -> f64 {
        let BiquadSpec { b0, b1, b2, a1, a2 } = self.spec();
        let e = 1.0 + a2;
        let numerator = (b0 * b0 + b1 * b1 + b2 * b2) * e - 2.0 * (b0 + b2) * b1 * a1
            + 2.0 * b0 * b2 * (a1 * a1 - a2 * e);
        libm::sqrt(numerator / ((1.0 - a2) * (e - a1) * (e + a1)))
    }

    /// Returns the steady state for the constant input `x`, from which this input gives no
    /// transient.
    ///
    /// If `x` is NaN or beyond [`LARGEST_SAMPLE`](crate::LARGEST_SAMPLE), the result is the empty
    /// memory.
    pub fn settled_at(&self, x: T) -> BiquadMemory<T> {
        if !sample::usable(x) {
            return self.memory();
        }
        let y = T::from_f64(self.dc_gain()) * x;
        BiquadMemory { s1: y - self.b0 * x, s2: self.b2 * x - self.a2 * y }
    }

    /// Processes one sample, which the caller has checked.
    #[inline(always)]
    pub(crate) fn pass(&self, memory: &mut BiquadMemory<T>, x: T) -> T {
        let y = self.b0 * x + memory.s1;
        // The terms without y are added first, which keeps the dependency chain from y to y short.
        memory.s1 = (memory.s2 + self.b1 * x) - self.a1 * y;
        memory.s2 = self.b2 * x - self.a2 * y;
        y
    }
}

impl<T: Real> Design for Biquad<T> {
    type Memory = BiquadMemory<T>;

    fn memory(&self) -> BiquadMemory<T> {
        BiquadMemory::default()
    }
}

impl<T: Real> Stage<T> for Biquad<T> {
    type Out = T;

    #[inline]
    fn step(&self, memory: &mut BiquadMemory<T>, x: T) -> T {
        if sample::usable(x) { self.pass(memory, x) } else { T::nan() }
    }
}
