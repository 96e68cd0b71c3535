#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod column;
mod data_set;
mod digits;
mod error;
mod even;
mod even_session;
pub mod files;
mod rig_file;
mod toml_file;
mod toml_text;
mod trial;
mod wrap;
mod write;

pub use column::{Quantity, column_meant, snake_case, spelt_unit, unit, unit_of, written_unit};
pub use data_set::{DataSet, Split, TrialEntry, TrialKind, digest_of, is_digest};
pub use digits::{after_number, in_digits, resampling, significant};
pub use error::{DataError, Place, error_sentence, listed, nearest, rename_options, shown};
pub use even::{Even, EvenPart, EvenSpec, Rows};
pub use even_session::{EvenSession, EvenTrial, SessionTrial};
pub use rig_file::{EffectEntry, Parameter, RigFile, from_zero};
pub use toml_file::TomlFile;
pub use toml_text::{Remarks, toml_comment};
pub use trial::{
    Channel, Trial, are_row_numbers, check_rows, ends, full_name, out_of_order, rate_of, tidy_time,
};
pub use wrap::{Wrap, follow_turns};
pub use write::{can_name, push_number};
