#![doc = include_str!("../README.md")]
#![no_std]

mod accumulator;
mod basis;
mod confidence;
mod error;
mod factor;
mod fit;
mod fold;
mod quantile;

pub use accumulator::SurfaceAccumulator;
pub use confidence::{Bounds, Confidence};
pub use error::FitError;
pub use factor::Factor;
pub use fit::Fit;
