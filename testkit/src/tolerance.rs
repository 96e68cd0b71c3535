//! One table of tolerances, each with its reason.

/// Relative: a few roundings of `f64` along one short chain of operations.
pub const F64_ROUNDING: f64 = 1e-14;

/// Relative: a value printed by another tool with at least twelve digits.
pub const PRINTED: f64 = 1e-12;

/// Relative to the reference's full scale: the receptor folds normalisation into the
/// coefficients, so its terms differ from the paper's order by a few hundred roundings of
/// terms up to `3 * 4^5` (21 terms of the strategies' surfaces at four times the range).
pub const FOLDED: f64 = 1e-8;
