//! A running sum of products.

/// A 32-bit integer value in the upper word and the fraction of its last product in the lower word.
///
/// Instead of rounding each product by adding a half, the fraction of one product is carried into
/// the next. This costs no instruction, and the error stays below one least bit in either
/// direction.
#[derive(Clone, Copy)]
pub(super) struct Accumulator(pub(super) u64);

impl Accumulator {
    /// Starts at `c` plus a half minus 2^-32. With exactly one half, the compiler would emit a rounding multiplication
    /// (SMMLAR) on cores that have one, and that instruction drops the fraction.
    #[inline(always)]
    pub(super) fn new(c: i32) -> Self {
        Self::from_parts(c, (1 << 31) - 1)
    }

    /// Returns `c + value v / 2^32` with the fraction carried over: one SMLAL. The caller ensures that the sum fits.
    #[inline(always)]
    pub(super) fn times(self, v: i32, c: i32) -> Self {
        Self::from_parts(c, self.0 as u32).plus(self.value(), v)
    }

    /// Returns `self + a v / 2^32`.
    #[inline(always)]
    pub(super) fn plus(self, a: i32, v: i32) -> Self {
        Self(self.0.wrapping_add((i64::from(a) * i64::from(v)) as u64))
    }

    /// Returns this value with the fraction of another accumulator.
    #[inline(always)]
    pub(super) fn carrying(self, other: Self) -> Self {
        Self::from_parts(self.value(), other.0 as u32)
    }

    #[inline(always)]
    pub(super) fn from_parts(c: i32, rest: u32) -> Self {
        Self((u64::from(c as u32) << 32) | u64::from(rest))
    }

    #[inline(always)]
    pub(super) fn value(self) -> i32 {
        (self.0 >> 32) as i32
    }
}
