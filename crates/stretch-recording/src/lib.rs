#![doc = include_str!("../README.md")]

#[cfg(any(feature = "npz", feature = "mat", feature = "hdf5"))]
mod arrays;
mod blocks;
mod clock;
mod entry;
mod error;
mod grid;
#[cfg(feature = "mcap")]
mod mcap;
mod names;
mod options;
#[cfg(feature = "parquet")]
mod parquet;
mod read;
mod recording;
mod room;
#[cfg(feature = "rosbag")]
mod rosbag;
mod sniff;
mod stamps;
mod text;
#[cfg(any(feature = "mcap", feature = "rosbag"))]
mod topics;
#[cfg(any(feature = "npz", feature = "mat", feature = "mcap", feature = "rosbag"))]
mod whole;

pub use error::RecordingError;
pub use names::tidy_column;
pub use options::{ReadOptions, TimeUnit};
pub use recording::Recording;
pub use text::row_reader::{Row, RowReader};
