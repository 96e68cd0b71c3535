//! The tests of stretch-calibrate from outside, one program: linking takes longer than most of them.

mod diagnosed;
mod long;
mod remembering;
mod seal;
