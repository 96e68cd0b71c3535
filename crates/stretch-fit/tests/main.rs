//! The tests of stretch-fit from outside, one program: linking takes longer than most of them.

mod accuracy;
mod nalgebra;
mod properties;
mod reference;
mod refusals;
