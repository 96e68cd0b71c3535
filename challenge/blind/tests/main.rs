//! The tests of stretch-blind from outside, one program: linking takes longer than most of them.

mod cases;
mod frozen;
mod open;
mod score;
