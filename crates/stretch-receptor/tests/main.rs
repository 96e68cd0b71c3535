//! The tests of stretch-receptor from outside, one program: linking takes longer than most of them.

mod code;
mod defects;
mod diagnosed;
mod finite;
mod firmware;
mod fixed_observer;
mod intervals;
mod remembering;
mod soak;
mod stream;
