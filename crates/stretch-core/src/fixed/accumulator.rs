//! A running sum of products.

/// A value in least bits and the fraction that its last product left, 32 bits each.
///
/// The fraction of one product is carried into the next instead of a half: that
/// costs no instruction and rounds by less than one least bit either way.
#[derive(Clone, Copy)]
pub(super) struct Accumulator(pub(super) u64);

impl Accumulator {
    /// `c` and a half, less 2^-32: a whole half would be taken for a rounding
    /// product (SMMLAR) on cores that have it, which drops the fraction.
    #[inline(always)]
    pub(super) fn new(c: i32) -> Self {
        Self::from_parts(c, (1 << 31) - 1)
    }

    /// `c + self v / 2^32`, with what is left of it: one SMLAL. The sum is known to fit.
    #[inline(always)]
    pub(super) fn times(self, v: i32, c: i32) -> Self {
        Self::from_parts(c, self.0 as u32).plus(self.value(), v)
    }

    /// `self + a v / 2^32`.
    #[inline(always)]
    pub(super) fn plus(self, a: i32, v: i32) -> Self {
        Self(self.0.wrapping_add((i64::from(a) * i64::from(v)) as u64))
    }

    /// This value, with what another one left.
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
