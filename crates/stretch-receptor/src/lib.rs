#![doc = include_str!("../README.md")]
#![no_std]

mod across;
mod array;
pub mod code;
mod curve;
mod defects;
mod diagnosed;
mod example;
mod fold;
mod front;
mod gains;
mod history;
mod map;
pub mod numbers;
mod observer;
mod one;
mod reading;
mod receptor;
#[cfg(feature = "proptest")]
pub mod strategies;
mod zero;

pub use array::{
    ArrayMemory, ArrayReading, ArrayReceptor, ArrayWithheld, JUMP_SAMPLES, Jump, Loss, Repeats,
    ShiftMemory, ShiftWatch, Shifts, block_of, samples_a_tick,
};
pub use defects::{Defects, DefectsMemory};
pub use diagnosed::DiagnosedReceptor;
pub use example::{example_array, example_calibration, example_diagnosed, example_observer};
pub use front::{Front, MAX_BRIDGED, ReceptorMemory};
pub use history::HistoryReceptor;
pub use observer::ObserverReceptor;
pub use one::Receptor;
pub use reading::{Domain, Reading, Withheld};
pub use receptor::{BlendedReceptor, StretchReceptor};
pub use zero::{TurnFinder, TurnMemory, Zero, ZeroMemory, ZeroWatch};

/// The Rust of the tutorial for firmware, which runs as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../book/src/tutorials/firmware.md")]
struct FirmwareTutorial;
