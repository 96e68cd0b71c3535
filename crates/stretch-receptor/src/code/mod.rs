//! Receptors for boards: converter codes in, estimates out.
//!
//! A converter gives integers, and a Savitzky-Golay rate of integers is an integer. Therefore all steps before the
//! surface work without floating-point numbers, and for window shapes in common use they round nothing.
//! [`FixedReceptor`] handles branch, domain, warm-up and missing samples like
//! [`StretchReceptor`](crate::StretchReceptor). It evaluates the surface in 32-bit fixed point, with the estimate in
//! thousandths of the reference's unit: about 100 instructions a step on any Cortex-M.
//!
//! [`FixedObserver`] is the integer receptor for the observer, a model with memory.
//!
//! [`FixedCalibration::new`] converts a calibration once, on a computer. The result serialises to
//! about 100 bytes.
#![doc = include_str!("board.md")]

mod adc;
mod calibration;
mod code_map;
#[cfg(feature = "serde")]
mod code_record;
mod fold;
mod observer;
mod observer_numbers;
mod receptor;
mod scaled;

pub use adc::{Adc, AdcCode, AdcSpec, FIXED_BITS};
pub use calibration::{CODE_SCHEMA, FixedCalibration, FixedNumbers};
pub use code_map::{CodeMap, CodeSurface, Span};
pub use observer::{FixedObserver, IntegerMemory, IntegerObserver};
pub use observer_numbers::{ObserverNumbers, RestNumbers};
pub use receptor::{CodeMemory, CodeReading, CodeSurfaces, FixedReceptor, SideBit};
pub use scaled::Scaled;
