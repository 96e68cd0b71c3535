//! The tests of stretch-problem from outside, one program: linking takes longer than most of them.

mod plant;
mod several;
mod workers;
