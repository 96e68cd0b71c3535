#![doc = include_str!("../README.md")]

mod error;
mod experiment;
mod frequency;
mod gaps;
mod pipeline;
mod published;

pub use error::PaperError;
pub use experiment::Experiment;
pub use frequency::{FrequencyPoint, frequency_response};
pub use gaps::{GapPoint, pulse_gaps};
pub use pipeline::Pipeline;
pub use published::{PUBLISHED, PublishedErrors, PublishedFigures, PublishedFit};
