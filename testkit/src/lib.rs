//! Helpers of the workspace's tests: tolerances, reference vectors, comparisons with expected
//! output, random numbers, and access to measured data.
//!
//! Every tolerance in [`tolerance`] has a name and a reason. Tests use these names instead of bare
//! numbers where they can.

pub mod corpus;
pub mod measured;
pub mod page;
pub mod random;
pub mod tolerance;
pub mod vectors;
