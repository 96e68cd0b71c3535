//! Another program as a source: long-lived workers that answer frames over standard input and output.
//!
//! The protocol is written down byte by byte in `book/src/reference/worker.md`.

mod fmu;
mod frame;
mod group;
mod message;
mod pool;
mod process;

pub use frame::{FrameError, PREFIX, Prefix, WorkerFrame};
pub use message::{read_session, session_header};
pub use pool::{Workers, WorkersSpec};
