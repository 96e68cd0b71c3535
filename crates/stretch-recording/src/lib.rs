#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod arrays;
mod clock;
mod entry;
mod error;
mod grid;
mod names;
mod options;
#[cfg(feature = "parquet")]
mod parquet;
mod read;
mod recording;
mod room;
mod sniff;
mod stamps;
mod text;
mod time_column;

pub use arrays::{Array, Clock};
pub use error::{FieldFault, RecordingError};
pub use names::tidy_column;
pub use options::{DateOrder, ReadOptions, TimeUnit};
pub use recording::{Recording, is_format_note};
pub use text::row_reader::{Row, RowReader};
pub use time_column::{TimeColumn, parse_rate};
