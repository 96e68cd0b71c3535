#![doc = include_str!("../README.md")]

mod error;
mod experiment;
mod frequency;
mod gaps;
mod published;

pub use error::PaperError;
pub use experiment::{Experiment, Pipeline};
pub use frequency::{FrequencyPoint, frequency_response};
pub use gaps::{GapPoint, pulse_gaps};
pub use published::{PUBLISHED, PublishedErrors, PublishedFigures, PublishedFit};
