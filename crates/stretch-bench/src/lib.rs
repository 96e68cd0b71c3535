#![doc = include_str!("../README.md")]

mod acting;
mod causes;
mod ends;
mod error;
mod examined;
mod fix;
mod gauge;
mod implement;
mod kept;
mod lost;
mod rig;
mod rig_file;
mod specs;
mod wild;

pub use causes::{Causes, causes};
pub use error::BenchError;
pub use examined::{Bench, Examined};
pub use fix::{Fix, NoFix};
pub use gauge::{GaugeSetup, GaugeSimulator};
pub use implement::Implementation;
pub use rig::{RigSetup, RigSimulator, RigTrial, Session};
