#![doc = include_str!("../README.md")]

mod carry;
mod data_set;
mod digest;
mod disk;
mod error;
mod even;
mod even_session;
mod header;
mod interrupt;
mod lines;
mod nearest;
mod outputs;
mod read;
mod read_options;
mod read_whole;
mod recording;
mod rig_file;
mod row;
mod row_reader;
#[cfg(feature = "proptest")]
pub mod strategies;
mod stream;
mod temporary;
mod toml_file;
mod toml_text;
mod toml_view;
mod trial;
mod write;
mod write_folder;
mod write_whole;

pub use data_set::{DataSet, Split, TrialEntry, TrialKind};
pub use disk::DiskCall;
#[doc(hidden)]
pub use disk::ask_before_disk_calls;
pub use error::{DataError, Place};
pub use even::{Even, EvenPart, EvenSpec, Rows};
pub use even_session::{EvenSession, EvenTrial, SessionTrial};
pub use interrupt::{interrupt, interrupted, writers_open};
pub use nearest::nearest;
pub use outputs::Outputs;
pub use read_options::{ReadOptions, TimeUnit};
pub use read_whole::read_whole;
pub use recording::Recording;
pub use rig_file::{EffectEntry, Parameter, Remarks, RigFile};
pub use row_reader::{Row, RowReader};
pub use stream::is_standard_output;
pub use temporary::without_temporary_names;
pub use toml_file::TomlFile;
pub use toml_view::TomlView;
pub use trial::{Channel, Trial, unit};
pub use write::push_number;
pub use write_folder::{recover, write_folder};
pub use write_whole::write_whole;
