#![doc = include_str!("../README.md")]
#![no_std]

pub mod code;
mod example;
mod map;
mod reading;
mod receptor;
#[cfg(feature = "proptest")]
pub mod strategies;

pub use example::example_calibration;
pub use reading::{Domain, Reading, Withheld};
pub use receptor::{MAX_BRIDGED, ReceptorMemory, StretchReceptor};
