#![doc = include_str!("../README.md")]

mod error;
mod gauge;
mod outside;
mod rig;
mod rig_file;

pub use error::BenchError;
pub use gauge::{GaugeSetup, GaugeSimulator};
pub use rig::{RigSetup, RigSimulator, RigTrial, Session};
