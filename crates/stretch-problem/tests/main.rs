//! The integration tests of stretch-problem, in one program because linking takes longer than most
//! of them.

mod budget;
mod by_trial;
mod contacts;
mod coupled;
mod diverging;
mod effects;
mod experiments;
mod flow;
mod friction;
mod gauge;
mod golden;
mod gross;
mod in_memory;
mod invariance;
mod joints;
mod keys;
mod pendulum;
mod plan;
mod plant;
mod predict;
mod profile;
mod ranges;
mod repeated;
mod rests;
mod rig;
mod sensors;
mod several;
mod states;
mod steps;
mod support;
mod units;
mod workers;
mod wrapped;
