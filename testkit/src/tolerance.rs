//! One table of tolerances, each with its reason.

/// Relative: a few roundings of `f64` along one short chain of operations.
pub const F64_ROUNDING: f64 = 1e-14;

/// Relative: a value printed by another tool with at least twelve digits.
pub const PRINTED: f64 = 1e-12;
