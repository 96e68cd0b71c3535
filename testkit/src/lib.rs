//! Tolerances, reference vectors, folders of invalid files, and access to measured data, shared by
//! the tests of the workspace.
//!
//! Every tolerance has a name and a reason. Tests do not contain bare numbers.

pub mod corpus;
pub mod measured;
pub mod page;
pub mod random;
pub mod tolerance;
pub mod vectors;
