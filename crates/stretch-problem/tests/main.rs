//! The tests of stretch-problem from outside, one program: linking takes longer than most of them.

mod budget;
mod by_trial;
mod contacts;
mod coupled;
mod effects;
mod experiments;
mod flow;
mod gauge;
mod golden;
mod gross;
mod in_memory;
mod invariance;
mod joints;
mod keys;
mod pendulum;
mod plant;
mod predict;
mod repeated;
mod rests;
mod rig;
mod sensors;
mod several;
mod states;
mod support;
mod units;
mod workers;
