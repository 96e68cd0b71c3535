//! Tolerances and reference vectors that the workspace's own tests share.
//!
//! Every tolerance has a name and a reason; tests never spell a bare number.

pub mod tolerance;
pub mod vectors;
