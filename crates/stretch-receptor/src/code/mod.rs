//! Receptors for boards: converter codes in, estimates out.
//!
//! A converter gives integers, and a Savitzky-Golay rate of integers is an integer. No
//! floating-point number is needed before the surface is evaluated, and for window shapes in common
//! use nothing is rounded before it. [`CodeReceptor`] handles branch, domain, warm-up and missing
//! samples like [`StretchReceptor`](crate::StretchReceptor). It evaluates the surface
//!
//! - in 32-bit fixed point ([`FixedReceptor`]), with the estimate in thousandths of the reference's
//!   unit: about 100 instructions a step on any Cortex-M;
//! - in `f32` ([`CodeReceptor<f32, ..>`](CodeReceptor)), with the estimate in the reference's unit:
//!   about 900 instructions a step on a Cortex-M3, most of them for six products and six sums.
//!
//! [`FixedObserver`] is the integer receptor for the observer, a model with memory.
//!
//! [`CodeCalibration::new`] converts a calibration once, on a computer. The result serialises to
//! about 100 bytes.
#![doc = include_str!("board.md")]

mod adc;
mod arithmetic;
mod calibration;
mod code_map;
#[cfg(feature = "serde")]
mod code_record;
mod fixed_arithmetic;
mod float_arithmetic;
mod fold;
mod observer;
mod observer_numbers;
mod reading;
mod receptor;

pub use adc::{Adc, AdcCode, AdcSpec, FIXED_BITS};
pub use arithmetic::CodeArithmetic;
pub use calibration::{CODE_SCHEMA, CodeCalibration, FixedCalibration, FixedNumbers};
pub use code_map::{CodeMap, CodeSurface, Span};
pub use fixed_arithmetic::{Fixed, Scaled};
pub use observer::{FixedObserver, IntegerMemory, IntegerObserver};
pub use observer_numbers::{ObserverNumbers, RestNumbers};
pub use reading::CodeReading;
pub use receptor::{CodeMemory, CodeReceptor, CodeSurfaces, FixedReceptor, SideBit};
