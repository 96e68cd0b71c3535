#![doc = include_str!("../README.md")]
#![no_std]

mod degree;
mod error;
mod range;
mod rate;
mod real;
mod stage;
mod surface;
mod unit;

pub use degree::{Degree, MAX_DEGREE, MAX_TERMS};
pub use error::DesignError;
pub use range::{Normalisation, Range, RangeSpec};
pub use rate::RateEstimator;
pub use real::Real;
pub use stage::{Design, Runner, Stage};
pub use surface::{Poly13, Surface};
pub use unit::{Hertz, Millimetres, MillimetresPerSecond, SampleRate, Seconds, Strain, Volts};
