//! Integration tests of stretch-gap. They form one program, because linking takes longer than most
//! tests.

mod answers;
mod consistent;
mod detectable;
mod gauge;
mod invariant;
mod laboratory;
mod located;
mod missing_term;
mod noise_too_high;
mod null_band;
mod probable;
mod proposals;
mod stable;
mod toy_basics;
mod toy_invariance;
mod toy_noise;
mod toy_nuisances;
mod toy_record;
mod toy_refusals;
mod toy_retuning;
mod toy_sample_roles;
mod toy_starts;
mod toys;
mod verdicts;
