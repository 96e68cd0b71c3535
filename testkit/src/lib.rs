//! Tolerances, reference vectors, and the way to measured data, that the workspace's own tests share.
//!
//! Every tolerance has a name and a reason; tests never spell a bare number.

pub mod measured;
pub mod tolerance;
pub mod vectors;
