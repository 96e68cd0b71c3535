#![doc = include_str!("../README.md")]

mod acting;
mod causes;
mod error;
mod gauge;
mod kept;
mod lost;
mod rig;
mod rig_file;
mod specs;
mod wild;

pub use causes::causes;
pub use error::BenchError;
pub use gauge::{GaugeSetup, GaugeSimulator};
pub use rig::{RigSetup, RigSimulator, RigTrial, Session};
