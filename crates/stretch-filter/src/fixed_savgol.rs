//! Causal Savitzky-Golay rate estimator in integers, whose cost does not depend on the window.

use core::marker::PhantomData;

use crate::fixed_taps::{FixedTaps, MAX_FIXED_SG_DEGREE, MOMENTS, choose};
use stretch_core::{Design, Stage};

mod sealed {
    pub trait Sample: Copy + Default + core::fmt::Debug + PartialEq {
        type Sum: Copy + Default + core::fmt::Debug + PartialEq;
        /// Largest magnitude of a sample.
        const LARGEST: i128;
        const LARGEST_SUM: i128;
        fn widen(self) -> Self::Sum;
        /// Returns `sum + other - choose * old`, wrapping.
        fn slide(sum: Self::Sum, other: Self::Sum, choose: i32, old: Self) -> Self::Sum;
        /// Returns `total + weight * sum`, wrapping.
        fn weigh(total: i64, weight: i32, sum: Self::Sum) -> i64;
    }

    impl Sample for u16 {
        type Sum = i32;
        const LARGEST: i128 = u16::MAX as i128;
        const LARGEST_SUM: i128 = i32::MAX as i128;
        #[inline(always)]
        fn widen(self) -> i32 {
            self.into()
        }
        #[inline(always)]
        fn slide(sum: i32, other: i32, choose: i32, old: u16) -> i32 {
            sum.wrapping_add(other).wrapping_sub(choose.wrapping_mul(old.into()))
        }
        #[inline(always)]
        fn weigh(total: i64, weight: i32, sum: i32) -> i64 {
            total.wrapping_add(i64::from(weight) * i64::from(sum))
        }
    }

    impl Sample for i32 {
        type Sum = i64;
        const LARGEST: i128 = 1 << 31;
        const LARGEST_SUM: i128 = i64::MAX as i128;
        #[inline(always)]
        fn widen(self) -> i64 {
            self.into()
        }
        #[inline(always)]
        fn slide(sum: i64, other: i64, choose: i32, old: i32) -> i64 {
            sum.wrapping_add(other).wrapping_sub(i64::from(choose) * i64::from(old))
        }
        #[inline(always)]
        fn weigh(total: i64, weight: i32, sum: i64) -> i64 {
            total.wrapping_add(sum.wrapping_mul(weight.into()))
        }
    }
}

/// An integer sample: `u16` (such as the code of an analogue-to-digital converter, with sums in 32
/// bits) or `i32` (with sums in 64 bits).
pub trait FixedSample: sealed::Sample {}
impl FixedSample for u16 {}
impl FixedSample for i32 {}

/// Estimator of the rate of an integer signal by a causal Savitzky-Golay fit of `DEGREE` 1 to 3
/// through the newest `WINDOW` samples, evaluated `DELAY` samples before the newest.
///
/// It is the same filter as [`SgRate`](crate::SgRate), with two differences. Its taps are exact
/// fractions of integers, so that nothing is rounded if the result fits 32 bits. And it does not
/// sum the whole window for each sample, but updates moments of the window:
///
/// ```text
/// B_0 <- B_0 + x[now] - x[now-n],    B_k <- B_k + B_(k-1) - C(n, k) x[now-n]
/// y = (T_0 B_0 + ... + T_d B_d) >> SHIFT
/// ```
///
/// Here n is the window, C(n, k) are binomial coefficients, T_k are integer weights, and d is the
/// degree. The cost is the same for any window. A sliding sum of floats would accumulate rounding
/// errors, but a sum of integers is exact.
///
/// The output is an integer. Multiply it by [`PER_SAMPLE`](Self::PER_SAMPLE) to get the change of
/// the signal per sample. It fits 32 bits for every possible input, which is checked at compile
/// time. The output is `None` until the window is full.
///
/// ```
/// use stretch_core::Runner;
/// use stretch_filter::FixedSgRate;
///
/// type Rate = FixedSgRate<u16, 11, 2>;
/// let mut rate = Runner::new(Rate::new());
/// let last = (0..20u16).filter_map(|n| rate.step(1000 + n * n)).last().unwrap();
/// assert_eq!(last, 38 * 4290); // exact on a parabola: (n^2)' = 2 n, over 4290
/// assert_eq!(f64::from(last) * Rate::PER_SAMPLE, 38.0);
/// ```
///
/// A shape whose moments overflow the integer type does not compile:
/// ```compile_fail
/// use stretch_core::Runner;
/// use stretch_filter::FixedSgRate;
/// let _ = Runner::new(FixedSgRate::<u16, 64, 3>::new()); // moments of 16 bits leave 32
/// ```
///
/// Source: Savitzky and Golay 1964, doi:10.1021/ac60214a047. The moments are computed as in
/// Hogenauer's integrators and combs, doi:10.1109/TASSP.1981.1163535.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedSgRate<S, const WINDOW: usize, const DEGREE: usize, const DELAY: usize = 0>(
    PhantomData<S>,
);

/// The integer constants of a [`FixedSgRate`], for implementing its step in another language. The
/// letters are those of the equations of [`FixedSgRate`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FixedSgIntegers {
    /// Samples in the window.
    pub window: usize,
    /// Degree of the polynomial.
    pub degree: usize,
    /// T_k, in the first `degree + 1` places.
    pub weights: [i32; MOMENTS],
    /// C(n, k), in the first `degree + 1` places.
    pub choose: [i32; MOMENTS],
    /// SHIFT, the right shift of the weighted sum.
    pub shift: u32,
    /// The factor f of [`FixedSgRate::change`]: `(((output f) >> (s - 9)) samples + 256) >> 9`.
    pub change_factor: i64,
    /// The shift s of the same expression.
    pub change_shift: u32,
}

/// State of a [`FixedSgRate`]: the window and its moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedSgMemory<S: FixedSample, const WINDOW: usize> {
    sums: [S::Sum; MOMENTS],
    /// Index of the oldest sample, or one past the end.
    oldest: u32,
    /// Samples until the window is full.
    remaining: u32,
    ring: [S; WINDOW],
}

impl<S: FixedSample, const WINDOW: usize> FixedSgMemory<S, WINDOW> {
    /// Returns the number of further samples that give `None` before the window is full.
    #[inline]
    pub fn remaining(&self) -> usize {
        self.remaining.saturating_sub(1) as usize
    }

    /// Returns the newest sample; zero before the first.
    pub fn newest(&self) -> S {
        let at = (self.oldest as usize).checked_sub(1).unwrap_or(WINDOW - 1);
        self.ring.get(at).copied().unwrap_or_default()
    }
}

impl<S: FixedSample, const WINDOW: usize, const DEGREE: usize, const DELAY: usize>
    FixedSgRate<S, WINDOW, DEGREE, DELAY>
{
    const TAPS: FixedTaps = {
        assert!(DEGREE >= 1 && DEGREE <= MAX_FIXED_SG_DEGREE, "DEGREE must be 1 ..= 3");
        assert!(WINDOW > DEGREE, "WINDOW must exceed DEGREE: too few samples for the polynomial");
        assert!(DELAY < WINDOW, "DELAY must lie inside the window");
        let taps = FixedTaps::of(WINDOW, DEGREE, DELAY);
        // sum of C(j, DEGREE) over the window: the largest moment
        assert!(
            choose(WINDOW, DEGREE + 1) * S::LARGEST <= S::LARGEST_SUM,
            "WINDOW is too long: a moment of the window would not fit"
        );
        assert!(taps.total * S::LARGEST < 1 << 62, "the weighted sum would not fit");
        taps
    };

    /// Number of low bits of the weighted sum that are rounded away: 0 for the shapes in common use
    /// on 16-bit samples.
    pub const SHIFT: u32 = {
        let mut shift = 0;
        while (Self::TAPS.total * S::LARGEST) >> shift >= i32::MAX as i128 {
            shift += 1;
        }
        shift
    };

    /// Change of the signal per sample and per unit of the output.
    pub const PER_SAMPLE: f64 = (1i64 << Self::SHIFT) as f64 / Self::TAPS.denominator as f64;

    /// Bound on the magnitude of the output for any samples.
    pub const LARGEST: i32 = ((Self::TAPS.total * S::LARGEST) >> Self::SHIFT) as i32 + 1;

    /// Creates the filter. It stores no numbers, because all constants belong to its type.
    #[must_use]
    pub const fn new() -> Self {
        let _ = Self::TAPS; // the shape is checked here at the latest
        Self(PhantomData)
    }

    /// Returns the steady state for the constant input `x`: no warm-up and no transient.
    #[must_use]
    pub fn settled_at(&self, x: S) -> FixedSgMemory<S, WINDOW> {
        let mut memory = self.memory();
        while memory.remaining > 0 {
            let _ = self.step(&mut memory, x);
        }
        memory
    }

    /// Returns the output for the current window.
    #[inline(always)]
    fn output(memory: &FixedSgMemory<S, WINDOW>) -> i32 {
        let half = if Self::SHIFT == 0 { 0 } else { 1 << (Self::SHIFT.max(1) - 1) };
        let mut total = half;
        for k in 0..=DEGREE {
            total = S::weigh(total, Self::TAPS.weights[k], memory.sums[k]);
        }
        (total >> Self::SHIFT) as i32
    }

    /// Factor and shift of [`change`](Self::change): 29 bits of `PER_SAMPLE`.
    const CHANGE: (i64, u32) = {
        let (denominator, mut shift) = (Self::TAPS.denominator as i128, Self::SHIFT);
        while (1i128 << shift) / denominator < 1 << 28 {
            shift += 1;
        }
        let factor = ((1i128 << shift) + denominator / 2) / denominator;
        assert!(
            factor < 1 << 30 && shift - Self::SHIFT >= 9,
            "the output is too coarse: one unit of it is a change of the signal of 2^20 or more per sample (PER_SAMPLE)"
        );
        (factor as i64, shift - Self::SHIFT)
    };

    /// The integer constants of a step.
    ///
    /// ```
    /// type Rate = stretch_filter::FixedSgRate<u16, 11, 2>;
    /// let integers = Rate::INTEGERS;
    /// assert_eq!(integers.weights[..3], [945, -489, 100]);
    /// assert_eq!(integers.choose[..3], [1, 11, 55]);
    /// assert_eq!(integers.shift, 0);
    /// ```
    pub const INTEGERS: FixedSgIntegers = FixedSgIntegers {
        window: WINDOW,
        degree: DEGREE,
        weights: Self::TAPS.weights,
        choose: binomials(WINDOW),
        shift: Self::SHIFT,
        change_factor: Self::CHANGE.0,
        change_shift: Self::CHANGE.1,
    };

    /// Converts an output to the change of the signal over `samples` samples, rounded.
    ///
    /// ```
    /// type Rate = stretch_filter::FixedSgRate<u16, 11, 2>;
    /// assert_eq!(Rate::new().change(-7 * 4290, 3), -21);
    /// ```
    #[inline]
    #[must_use]
    pub fn change(&self, output: i32, samples: u8) -> i64 {
        let (factor, shift) = Self::CHANGE;
        // the product has at most 31 + 30 bits; nine fractional bits are kept for the next product
        let per_sample = (i64::from(output) * factor) >> (shift - 9);
        (per_sample * i64::from(samples) + 256) >> 9
    }

    /// Returns the output of the last step again; `None` during the warm-up.
    #[inline]
    pub fn last(&self, memory: &FixedSgMemory<S, WINDOW>) -> Option<i32> {
        (memory.remaining == 0).then(|| Self::output(memory))
    }
}

impl<S: FixedSample, const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Default
    for FixedSgRate<S, WINDOW, DEGREE, DELAY>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<S: FixedSample, const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Design
    for FixedSgRate<S, WINDOW, DEGREE, DELAY>
{
    type Memory = FixedSgMemory<S, WINDOW>;

    fn memory(&self) -> FixedSgMemory<S, WINDOW> {
        FixedSgMemory {
            sums: Default::default(),
            oldest: 0,
            remaining: WINDOW as u32,
            ring: [S::default(); WINDOW],
        }
    }
}

impl<S: FixedSample, const WINDOW: usize, const DEGREE: usize, const DELAY: usize> Stage<S>
    for FixedSgRate<S, WINDOW, DEGREE, DELAY>
{
    type Out = Option<i32>;

    #[inline(always)]
    fn step(&self, memory: &mut FixedSgMemory<S, WINDOW>, x: S) -> Option<i32> {
        // wraps the index, and shows the compiler that it is in bounds
        let at = memory.oldest as usize;
        let at = if at < WINDOW { at } else { 0 };
        let old = core::mem::replace(&mut memory.ring[at], x);
        memory.oldest = at as u32 + 1;
        for k in (1..=DEGREE).rev() {
            let choose = const { binomials(WINDOW) }[k];
            memory.sums[k] = S::slide(memory.sums[k], memory.sums[k - 1], choose, old);
        }
        memory.sums[0] = S::slide(memory.sums[0], x.widen(), 1, old);
        if memory.remaining > 0 {
            memory.remaining -= 1;
            if memory.remaining > 0 {
                return None;
            }
        }
        Some(Self::output(memory))
    }
}

/// Returns C(n, k) for every moment. A value may wrap, but no valid shape uses such a value.
const fn binomials(n: usize) -> [i32; MOMENTS] {
    let (mut all, mut k) = ([0; MOMENTS], 0);
    while k < MOMENTS {
        all[k] = choose(n, k) as i32;
        k += 1;
    }
    all
}
