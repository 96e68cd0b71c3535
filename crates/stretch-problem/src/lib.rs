#![doc = include_str!("../README.md")]

mod black_box;
mod columns;
mod error;
mod families;
mod file;
mod init;
mod linear;
mod problem;
mod runs;
mod source;
mod spec;
mod velocity;
pub mod worker;
mod wrap;

pub use black_box::BlackBox;
pub use error::ProblemError;
pub use families::{Agreed, agreed};
pub use file::{ProblemFile, SimulatorEntry, TrialFile, WorkersEntry};
pub use init::first_problem;
pub use problem::Problem;
pub use source::{
    Ask, Closure, Session, SessionColumn, SessionPart, SessionStage, Source, SourceError, closure,
};
pub use spec::{Argument, Input, OwnEffect, Parameter, ProblemSpec, Stage, Tolerance};
pub use wrap::{Beside, Extent, Family, Measure, Side, Starts, Wrapper, wrapper_named, wrappers};
