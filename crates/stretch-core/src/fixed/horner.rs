//! Overflow check for Horner's rule.

use crate::DesignError;

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
