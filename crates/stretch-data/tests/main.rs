//! The tests of stretch-data from outside, one program: linking takes longer than most of them.

mod bad_input;
mod even;
mod round_trips;
