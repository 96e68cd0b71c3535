//! The tests of stretch-metrics from outside, one program: linking takes longer than most of them.

mod limits;
mod properties;
mod reference;
