#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

pub mod code;
mod curve;
mod defects;
mod diagnosed;
mod error;
mod example;
mod fold;
mod front;
mod gains;
mod history;
mod map;
pub mod model;
pub mod numbers;
mod observer;
mod one;
mod reading;
mod receptor;

pub use defects::{Defects, DefectsMemory};
pub use diagnosed::DiagnosedReceptor;
pub use error::ReceptorError;
pub use example::{example_calibration, example_diagnosed, example_observer};
pub use front::{Front, MAX_BRIDGED, ReceptorMemory};
pub use history::HistoryReceptor;
pub use observer::ObserverReceptor;
pub use one::Receptor;
pub use reading::{Domain, Reading, Withheld};
pub use receptor::StretchReceptor;

/// The Rust code of the firmware tutorial, which runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../book/src/tutorials/firmware.md")]
struct FirmwareTutorial;
