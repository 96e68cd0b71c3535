#![doc = include_str!("../README.md")]

mod arduino;
mod constants;
mod error;
mod export;
mod models;
mod part;
mod self_test;

pub use arduino::{File, arduino_library};
pub use error::ExportError;
pub use export::{
    Form, HEADER, Header, Options, SELF_TEST_SAMPLES, array_header, gauge_header, header,
};
