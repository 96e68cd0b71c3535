//! A running sum of products, and the check that Horner's rule does not overflow it.

use crate::DesignError;

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

/// Checks that `terms[0] + terms[1]/2 + terms[2]/4 + ...` and every tail of that sum stay inside 32
/// bits, with room for rounding errors. Returns the sum.
pub(super) fn check_horner(field: &'static str, terms: &[u32]) -> Result<u32, DesignError> {
    const MOST: u32 = i32::MAX as u32 - 8;
    let mut sum = 0u32;
    for &term in terms.iter().rev() {
        sum = sum.div_ceil(2).saturating_add(term);
        if sum > MOST {
            return Err(DesignError::OutOfRange { field, value: sum.into() });
        }
    }
    Ok(sum)
}
