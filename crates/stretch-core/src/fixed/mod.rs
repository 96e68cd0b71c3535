//! Fixed-point arithmetic with 32-bit numbers and 64-bit products, in which nothing can overflow.
//!
//! Two formats are used, both carried by a plain `i32`:
//!
//! | format | value of the integer `n` | where |
//! | --- | --- | --- |
//! | Q27 | `n / 2^27`, from -16 to 16 | [`FixedRange`]: normalised channels with headroom |
//! | half | `n / 2^32`, from -1/2 to 1/2 | inputs of [`FixedPoly13`] and [`FixedLine`] |
//!
//! In the format "half" the product is the upper word of a 64-bit product. A step of Horner's rule is therefore one
//! multiply-accumulate (`SMLAL`) without a shift.
//!
//! Integer arithmetic gives the same bits on every processor. Designs are computed in `f64`, and refused if they do not
//! fit ([`DesignError::OutOfRange`](crate::DesignError::OutOfRange)). A step takes any `i32` and never panics or wraps.

mod accumulator;
mod convert;
mod horner;
mod line;
mod poly13;
mod range;

pub use convert::{from_f64, saturate};
pub use line::FixedLine;
pub use poly13::FixedPoly13;
pub use range::{FixedRange, RangeUnits};
