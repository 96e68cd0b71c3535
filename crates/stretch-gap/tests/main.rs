//! The tests of stretch-gap from outside, one program: linking takes longer than most of them.

mod floor;
mod gauge;
mod missing_term;
mod null_band;
mod toy_basics;
mod toy_frame;
mod toy_invariance;
mod toy_noise;
mod toy_nuisances;
mod toy_record;
mod toy_refusals;
mod toy_retuning;
mod toys;
