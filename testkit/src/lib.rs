//! Tolerances, reference vectors, folders of odd files, and the way to measured data, that the workspace's own tests share.
//!
//! Every tolerance has a name and a reason; tests never spell a bare number.

pub mod corpus;
pub mod measured;
pub mod page;
pub mod random;
pub mod tolerance;
pub mod vectors;
