//! A second-order filter section (biquad) in fixed point.

use crate::{BiquadSpec, sample};
use stretch_core::{
    Design, DesignError, Stage,
    fixed::{from_f64, saturate},
};

/// A stable second-order section on `i32`, saturating, in direct form I.
///
/// ```text
/// sum = b0 x + b1 x1 + b2 x2 - a1 y1 - a2 y2 + rest       64 bits, exact
/// y = saturate(sum >> bits);  rest = what the shift left behind
/// ```
///
/// A step takes five 32 x 32 -> 64 multiply-accumulates. The remainder of every shift is added to
/// the next sum (first-order error feedback). The average output for a constant input therefore has
/// the gain [`dc_gain`](Self::dc_gain), to less than one bit. A design is refused if its
/// coefficients could make the sum exceed 64 bits, so no `i32` stream overflows. A result outside
/// 32 bits becomes the nearest `i32`.
///
/// Samples may have any unit. Scale them so that the largest leaves headroom for the overshoot of
/// the section. An `i32` cannot mark a missing sample: skip the step, and reset the memory after a long gap.
///
/// ```
/// use stretch_core::{Hertz, Runner, SampleRate};
/// use stretch_filter::{FixedBiquad, LowPassSpec};
///
/// let spec = LowPassSpec { cutoff: Hertz(5.0), sample_rate: SampleRate::new(100.0)? };
/// let section = spec.design::<f64, 2>()?.sections()[0];
/// let mut smooth = Runner::new(FixedBiquad::new(section.spec())?);
/// let last = (0..200).map(|_| smooth.step(1 << 20)).last().unwrap();
/// approx::assert_abs_diff_eq!(last, 1 << 20, epsilon = 1);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
///
/// Source: the error feedback is Dattorro's (The implementation of recursive
/// digital filters for high-fidelity audio, J. Audio Eng. Soc. 36, 1988).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedBiquad {
    /// b0, b1, b2, -a1, -a2, times 2^bits.
    taps: [i32; 5],
    bits: u32,
}

/// State of a [`FixedBiquad`]: the last two inputs and outputs, and the remainder of the last
/// shift.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FixedBiquadMemory {
    x1: i32,
    x2: i32,
    y1: i32,
    y2: i32,
    rest: u32,
}

impl FixedBiquad {
    /// Largest number of fractional bits of a coefficient.
    const MOST_BITS: u32 = 30;
    /// Smallest number of fractional bits of a coefficient. With fewer, rounding would move the
    /// cutoff of a low-pass.
    const LEAST_BITS: u32 = 16;

    /// Creates a section with these coefficients, rounded to as many bits as fit.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming the coefficient that is not finite or exceeds 1e18, or
    /// that puts a pole on or outside the unit circle after rounding (|a2| < 1 and |a1| < 1 + a2
    /// must hold). It names `b0` if the coefficients are too large for 16 fractional bits.
    pub fn new(spec: BiquadSpec) -> Result<Self, DesignError> {
        let BiquadSpec { b0, b1, b2, a1, a2 } = spec;
        for (field, c) in [("b0", b0), ("b1", b1), ("b2", b2), ("a1", a1), ("a2", a2)] {
            DesignError::check(field, c, c.abs() <= sample::LARGEST_SAMPLE)?;
        }
        let sum: f64 = [b0, b1, b2, a1, a2].map(f64::abs).iter().sum();
        let fits = |bits: u32| {
            let one = f64::from(1u32 << bits);
            // rounded magnitudes sum to less than 2^32, so the sum of a step with the remainder is
            // below 2^63
            let each = [b0, b1, b2, a1, a2].iter().all(|c| (c * one).abs() < 2147483647.0);
            each && sum * one < 4294967290.0
        };
        let bits = (Self::LEAST_BITS..=Self::MOST_BITS).rev().find(|&bits| fits(bits));
        let Some(bits) = bits else {
            return Err(DesignError::OutOfRange { field: "b0", value: b0 });
        };
        let round = |field, c| from_f64(field, c, bits);
        let taps = [
            round("b0", b0)?,
            round("b1", b1)?,
            round("b2", b2)?,
            round("a1", -a1)?,
            round("a2", -a2)?,
        ];
        let (one, ra1, ra2) = (1i64 << bits, -i64::from(taps[3]), -i64::from(taps[4]));
        DesignError::check("a2", a2, ra2.abs() < one)?;
        DesignError::check("a1", a1, ra1.abs() < one + ra2)?;
        Ok(Self { taps, bits })
    }

    /// Returns the coefficients in use, rounded.
    pub fn spec(&self) -> BiquadSpec {
        let one = f64::from(1u32 << self.bits);
        let [b0, b1, b2, a1, a2] = self.taps.map(|c| f64::from(c) / one);
        BiquadSpec { b0, b1, b2, a1: -a1, a2: -a2 }
    }

    /// Returns the gain for a constant input: H(1).
    pub fn dc_gain(&self) -> f64 {
        let c = self.spec();
        (c.b0 + c.b1 + c.b2) / (1.0 + c.a1 + c.a2)
    }

    /// Returns the steady state for the constant input `x`, from which this input gives no
    /// transient.
    pub fn settled_at(&self, x: i32) -> FixedBiquadMemory {
        let y = saturate(libm::round(self.dc_gain() * f64::from(x)) as i64);
        FixedBiquadMemory { x1: x, x2: x, y1: y, y2: y, rest: 1 << (self.bits - 1) }
    }
}

impl Design for FixedBiquad {
    type Memory = FixedBiquadMemory;

    fn memory(&self) -> FixedBiquadMemory {
        self.settled_at(0)
    }
}

impl Stage<i32> for FixedBiquad {
    type Out = i32;

    #[inline]
    fn step(&self, memory: &mut FixedBiquadMemory, x: i32) -> i32 {
        let m = *memory;
        let [b0, b1, b2, a1, a2] = self.taps.map(i64::from);
        let mut sum = i64::from(m.rest);
        sum += b0 * i64::from(x);
        sum += b1 * i64::from(m.x1);
        sum += b2 * i64::from(m.x2);
        sum += a1 * i64::from(m.y1);
        sum += a2 * i64::from(m.y2);
        let y = saturate(sum >> self.bits);
        let rest = sum as u32 & ((1 << self.bits) - 1);
        *memory = FixedBiquadMemory { x1: x, x2: m.x1, y1: y, y2: m.y1, rest };
        y
    }
}
