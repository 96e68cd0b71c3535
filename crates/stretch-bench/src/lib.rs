#![doc = include_str!("../README.md")]

mod acting;
mod error;
mod gauge;
mod rig;
mod specs;

pub use error::BenchError;
pub use gauge::{GaugeSimulator, GaugeTrial};
pub use rig::{RigSimulator, RigTrial, Session};
