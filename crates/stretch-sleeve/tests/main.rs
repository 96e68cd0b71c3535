//! The tests of stretch-sleeve from outside, one program: linking takes longer than most of them.

mod array;
mod firmware;
mod record;
