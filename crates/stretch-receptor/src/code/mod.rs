//! Converter codes in, estimates out: the receptor for a board.
//!
//! An analogue-to-digital converter gives integers, and a Savitzky-Golay rate of
//! integers is an integer: up to the surface nothing has to be rounded and no
//! floating-point number is needed. [`CodeReceptor`] works that way. It answers
//! like [`StretchReceptor`](crate::StretchReceptor) (branch, domain, warm-up,
//! missing samples) and evaluates the surface
//!
//! - in 32-bit fixed point ([`FixedReceptor`]): thousandths of the reference's
//!   unit, about 100 instructions on any Cortex-M; or
//! - in `f32` ([`CodeReceptor<f32, ..>`](CodeReceptor)): six products and six
//!   sums, the reference's unit.
//!
//! [`FixedObserver`] is the receptor of this kind for a model that remembers.
//!
//! A calibration is converted once, on a computer, by [`CodeCalibration::new`], and
//! travels as a record of about 100 bytes.
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
