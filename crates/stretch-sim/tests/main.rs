//! The integration tests of stretch-sim, in one program because linking takes longer than most
//! tests.

mod catalogue;
mod code;
mod conformance;
mod convergence;
mod properties;
mod session;
