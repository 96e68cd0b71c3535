//! The tests of stretch-bench from outside, one program: linking takes longer than most of them.

mod effects;
mod experiments;
mod gauge;
mod gross;
mod in_memory;
mod invariance;
mod rig;
mod support;
