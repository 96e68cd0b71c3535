//! The integration tests of stretch-fit, in one program because linking takes longer than most of
//! the tests.

mod accuracy;
mod nalgebra;
mod properties;
mod reference;
mod refusals;
