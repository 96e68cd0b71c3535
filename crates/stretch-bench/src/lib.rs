#![doc = include_str!("../README.md")]

mod error;
mod gauge;
mod outside;
mod rig;

pub use error::BenchError;
pub use gauge::{GaugeSimulator, GaugeTrial};
pub use rig::{RigSimulator, RigTrial, Session};
