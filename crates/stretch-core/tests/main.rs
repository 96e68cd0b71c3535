//! The tests of stretch-core from outside, one program: linking takes longer than most of them.

mod fixed;
mod properties;
mod records;
