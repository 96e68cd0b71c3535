//! The tests of stretch-sim from outside, one program: linking takes longer than most of them.

mod catalogue;
mod code;
mod conformance;
mod convergence;
mod properties;
mod session;
