#![doc = include_str!("../README.md")]

mod data_set;
mod rig_file;
mod trial;

pub use data_set::{DataSet, Split, TrialEntry, TrialKind};
pub use rig_file::{EffectEntry, Parameter, RigFile};
pub use trial::{Channel, Trial};
