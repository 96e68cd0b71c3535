#![doc = include_str!("../README.md")]

mod arduino;
mod array_test;
mod constants;
mod error;
mod export;
mod models;
mod options;
mod part;
mod self_test;

pub use arduino::{File, arduino_library};
pub use error::ExportError;
pub use export::{HEADER, Header, SELF_TEST_SAMPLES, array_header, gauge_header, header};
pub use options::{Form, Options};
