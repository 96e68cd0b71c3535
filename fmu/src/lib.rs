#![doc = include_str!("../README.md")]

mod archive;
mod bind;
mod deep;
mod describe;
mod error;
mod instance;
mod model;
mod serve;
mod source;

pub use archive::Fmu;
pub use bind::Names;
pub use describe::describe;
pub use error::FmuError;
pub use model::{Kind, Model, Role, Variable, Version};
pub use serve::{ServeError, serve};
pub use source::FmuSource;
