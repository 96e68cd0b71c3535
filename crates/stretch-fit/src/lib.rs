#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

mod accumulator;
mod basis;
mod confidence;
mod cross_validation;
mod error;
mod factor;
mod fit;
mod fold;
mod order_table;
mod robust;
mod sample;
mod scores;
mod shift;

pub use accumulator::SurfaceAccumulator;
pub use confidence::{Bounds, Confidence};
pub use cross_validation::{CrossValidation, HeldOut, cross_validate, held_out};
pub use error::FitError;
pub use factor::{Factor, FactorSpec};
pub use fit::Fit;
pub use order_table::{Excess, OrderEntry, OrderRow, OrderTable};
pub use robust::{Loss, RobustFit, robust_fit};
pub use sample::Sample;
