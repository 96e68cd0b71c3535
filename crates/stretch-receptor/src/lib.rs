#![doc = include_str!("../README.md")]
#![no_std]

mod blended;
pub mod code;
mod example;
mod fold;
mod gains;
mod history;
mod map;
mod observer;
mod one;
mod reading;
mod receptor;
mod rest_level;
#[cfg(feature = "proptest")]
pub mod strategies;

pub use blended::BlendedReceptor;
pub use example::{example_calibration, example_observer};
pub use history::{HistoryMemory, HistoryReceptor};
pub use observer::{ObserverMemory, ObserverReceptor};
pub use one::{Receptor, StoredMemory};
pub use reading::{Domain, Reading, Withheld};
pub use receptor::{MAX_BRIDGED, ReceptorMemory, StretchReceptor};
