#![doc = include_str!("../README.md")]

mod bench;
mod black_box;
mod by_trial;
mod causes;
mod error;
mod examine;
mod file;
mod fix;
mod foretell;
mod gauge;
mod implement;
mod init;
mod notation;
mod problem;
mod rig;
mod sensors;
mod transfer;
mod words;
pub mod worker;
mod wrap;

pub use black_box::{
    Agreed, AlteredColumn, Argument, Ask, BlackBox, Checked, Closure, Input, OwnEffect, Parameter,
    ProblemSpec, RecordedSession, Sensor, SessionColumn, SessionPart, SessionStage, Source,
    SourceError, StageEntry, State, Wrapped, agreed, closure,
};
pub use by_trial::{Apart, ByTrial, FittedValue, Heterogeneity, RunFit, Standing};
pub use causes::{Causes, causes};
pub use error::ProblemError;
pub use examine::Examined;
pub use file::{
    ProblemFile, SimulatorEntry, TrialFile, WorkersEntry, problem_reference, problem_schema,
};
pub use fix::{Fix, Fixed, NoFix};
pub use foretell::{
    Foretold, ForetoldOutput, ForetoldTrial, Outside, Unexcited, foretell, foretell_with,
};
pub use gauge::{GaugeSetup, GaugeSimulator};
pub use implement::Implementation;
pub use init::first_problem;
pub use notation::notation;
pub use problem::{Diagnosable, Problem, Reading, name_of};
pub use rig::{RigSession, RigSetup, RigSimulator, RigTrial};
pub use sensors::sensors;
pub use stretch_effects::{KINDS, Kind, Language, kind_named};
pub use stretch_sim::Tolerance;
pub use words::{effect_in_words, in_words};
