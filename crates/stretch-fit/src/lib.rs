#![doc = include_str!("../README.md")]
#![no_std]

mod accumulator;
mod basis;
mod confidence;
mod cross_validation;
mod error;
mod factor;
mod fit;
mod fold;
mod line;
mod order_table;
mod quantile;
mod robust;
mod scores;
mod shift;
#[cfg(feature = "proptest")]
pub mod strategies;

pub use accumulator::SurfaceAccumulator;
pub use confidence::{Bounds, Confidence};
pub use cross_validation::{CrossValidation, HeldOut, cross_validate, held_out};
pub use error::FitError;
pub use factor::{Factor, FactorSpec};
pub use fit::Fit;
pub use line::{LineAccumulator, LineFit};
pub use order_table::{OrderEntry, OrderRow, OrderTable};
pub use quantile::student_two_sided;
pub use robust::{Loss, RobustFit, robust_fit};
