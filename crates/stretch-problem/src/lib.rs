#![doc = include_str!("../README.md")]

mod bench;
mod black_box;
mod causes;
mod error;
mod examined;
mod file;
mod fix;
mod gauge;
mod implement;
mod init;
mod rig;
pub mod worker;
mod wrap;

pub use bench::error::BenchError;
pub use black_box::{
    Agreed, Argument, Ask, BlackBox, Closure, Input, OwnEffect, Parameter, Problem, ProblemSpec,
    Session, SessionColumn, SessionPart, SessionStage, Source, SourceError, Stage, Tolerance,
    agreed, closure,
};
pub use causes::{Causes, causes};
pub use error::ProblemError;
pub use examined::{Bench, Examined};
pub use file::{ProblemFile, SimulatorEntry, TrialFile, WorkersEntry};
pub use fix::{Fix, NoFix};
pub use gauge::{GaugeSetup, GaugeSimulator};
pub use implement::Implementation;
pub use init::first_problem;
pub use rig::{RigSession, RigSetup, RigSimulator, RigTrial};
pub use wrap::{Beside, Extent, Family, Measure, Side, Starts, Wrapper, wrapper_named, wrappers};
