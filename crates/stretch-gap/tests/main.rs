//! The tests of stretch-gap from outside, one program: linking takes longer than most of them.

mod floor;
mod gauge;
mod missing_term;
mod null_band;
mod toy_basics;
mod toys;
