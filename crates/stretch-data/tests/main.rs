//! The tests of stretch-data from outside, one program: linking takes longer than most of them.

mod bad_input;
mod corpus;
mod dialects;
mod even;
mod found;
mod recordings;
mod round_trips;
mod writing;
