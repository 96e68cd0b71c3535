#![doc = include_str!("../README.md")]

mod carry;
mod digest;
mod disk;
mod error;
mod interrupt;
mod outputs;
mod read_whole;
mod stream;
mod temporary;
mod write_folder;
mod write_whole;

pub use digest::{Checksum, digest_of, is_digest};
pub use disk::DiskCall;
#[doc(hidden)]
pub use disk::ask_before_disk_calls;
pub use error::FileError;
pub use interrupt::{interrupt, interrupted, writers_open};
pub use outputs::Outputs;
pub use read_whole::read_whole;
pub use stream::is_standard_output;
pub use temporary::without_temporary_names;
pub use write_folder::{recover, write_folder};
pub use write_whole::write_whole;
