#![doc = include_str!("../README.md")]
#![no_std]

mod error;
mod real;
mod stage;
mod unit;

pub use error::DesignError;
pub use real::Real;
pub use stage::{Design, Runner, Stage};
pub use unit::{Hertz, Millimetres, MillimetresPerSecond, SampleRate, Seconds, Strain, Volts};
