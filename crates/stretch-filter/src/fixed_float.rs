//! A Savitzky-Golay rate estimator for `f32` samples on a core without a floating-point unit.

use crate::{FixedSgMemory, FixedSgRate, LARGEST_SAMPLE, NamedRate, named::savitzky_golay, sample};
use stretch_core::{Design, DesignError, RateEstimator, SampleRate, Stage};

/// Estimator of the rate of an `f32` signal with integer sums: a [`FixedSgRate`] with conversions
/// before and after it.
///
/// It gives the same rate as [`SgRate`](crate::SgRate), for cores without a floating-point unit.
/// With a window of eleven samples, `SgRate` needs eleven soft-float products and ten sums (about
/// 1,400 instructions on a Cortex-M3). This type needs one conversion to an integer, an exact
/// sliding sum, and one product. On a core *with* a floating-point unit `SgRate` is smaller and
/// faster.
///
/// **Samples** are rounded to integer multiples of `2^(e-31)`, where `2^e` is the smallest power of
/// two that is at least the parameter `largest` of `new`. The conversion is exact for every `f32`
/// of magnitude `2^(e-8)` or more. A sample beyond `2^e` is clamped to `2^e`. A sample that is NaN
/// or beyond [`LARGEST_SAMPLE`] gives `None` and leaves the memory unchanged.
///
/// ```
/// use stretch_core::{Runner, SampleRate};
/// use stretch_filter::IntegerSgRate;
///
/// // a bridge of 0 .. 3.3 V
/// let design = IntegerSgRate::<11, 2>::new(SampleRate::new(100.0)?, 3.3)?;
/// let mut rate = Runner::new(design);
/// let last = (0..20).filter_map(|n| rate.step(1.0 + 0.01 * n as f32)).last().unwrap();
/// approx::assert_abs_diff_eq!(last, 1.0, epsilon = 1e-5); // volts a second
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegerSgRate<const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0> {
    sums: FixedSgRate<i32, WINDOW, DEGREE, DELAY>,
    /// Fractional bits of a quantised sample.
    fraction_bits: i32,
    /// Factor from the output of `sums` to the sample's unit per second.
    per_second: f32,
    sample_rate: SampleRate,
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    IntegerSgRate<WINDOW, DEGREE, DELAY>
{
    /// Creates the design for samples of at most `largest` in magnitude at `sample_rate`.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] for a sample rate outside 1e-9 ..= 1e9 Hz, or a `largest`
    /// outside 1e-6 ..= 1e18.
    pub fn new(sample_rate: SampleRate, largest: f64) -> Result<Self, DesignError> {
        let sample_rate = sample::checked_rate(sample_rate)?;
        DesignError::check("largest", largest, (1e-6..=LARGEST_SAMPLE).contains(&largest))?;
        let (mantissa, exponent) = libm::frexp(largest);
        // frexp gives 0.5 <= mantissa < 1, so the exponent is one too large if `largest` is a power
        // of two
        let exponent = if mantissa == 0.5 { exponent - 1 } else { exponent };
        let fraction_bits = 31 - exponent;
        let per_sample = FixedSgRate::<i32, WINDOW, DEGREE, DELAY>::PER_SAMPLE;
        let per_second = libm::ldexp(per_sample * sample_rate.hz(), -fraction_bits);
        let per_second = per_second as f32;
        Ok(Self { sums: FixedSgRate::new(), fraction_bits, per_second, sample_rate })
    }

    /// Returns `x 2^fraction_bits`, rounded and saturated, without a floating-point operation.
    #[inline(always)]
    fn quantise(&self, x: f32) -> Option<i32> {
        const LARGEST_BITS: u32 = (LARGEST_SAMPLE as f32).to_bits();
        let bits = x.to_bits();
        let magnitude = bits & 0x7fff_ffff;
        if magnitude > LARGEST_BITS {
            return None; // NaN has the largest bits of all
        }
        let mantissa = (magnitude & 0x007f_ffff) | 0x0080_0000;
        // x is the 24-bit mantissa times 2^(biased exponent - 150); a subnormal number is far below
        // half a step and becomes zero
        let shift = (magnitude >> 23) as i32 - 150 + self.fraction_bits;
        let size = if shift >= 8 {
            i32::MAX
        } else if shift >= 0 {
            (mantissa << shift).min(i32::MAX as u32) as i32
        } else if shift >= -24 {
            ((mantissa + (1 << (-shift - 1))) >> -shift) as i32
        } else {
            0
        };
        Some(if bits >> 31 == 0 { size } else { -size })
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Design
    for IntegerSgRate<WINDOW, DEGREE, DELAY>
{
    type Memory = FixedSgMemory<i32, WINDOW>;

    fn memory(&self) -> Self::Memory {
        self.sums.memory()
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> NamedRate
    for IntegerSgRate<WINDOW, DEGREE, DELAY>
{
    fn named(&self) -> Option<(RateEstimator, SampleRate)> {
        savitzky_golay(WINDOW, DEGREE, DELAY, self.sample_rate)
    }
}

impl<const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Stage<f32>
    for IntegerSgRate<WINDOW, DEGREE, DELAY>
{
    type Out = Option<f32>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, x: f32) -> Option<f32> {
        let x = self.quantise(x)?;
        self.sums.step(memory, x).map(|sum| sum as f32 * self.per_second)
    }
}
