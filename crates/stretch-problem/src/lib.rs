#![doc = include_str!("../README.md")]

mod bench;
mod black_box;
mod by_trial;
mod card;
mod causes;
mod compare;
mod error;
mod examine;
mod file;
mod fix;
mod gauge;
mod implement;
mod init;
mod plan;
mod predict;
mod problem;
mod ranges;
mod rig;
mod sensors;
mod transfer;
mod words;
pub mod worker;
mod wrap;

pub use black_box::{
    AlteredColumn, Argument, Ask, BlackBox, Checked, Closure, Input, OwnEffect, Parameter,
    PlanEntry, PlanInput, ProblemSpec, RecordedSession, SessionColumn, SessionPart, SessionStage,
    Source, SourceError, StageEntry, State, TrialFile, closure,
};
pub use by_trial::{Apart, ByTrial, Heterogeneity, RunFit, q_values};
pub use card::{Card, CardColumn, CardOutput, CardRecording};
pub use causes::{Causes, causes};
pub use compare::{Compared, Estimate, Octave, Pair};
pub use error::ProblemError;
pub use examine::{Examined, diagnosis_schema};
pub use file::{BuiltIn, SimulatorEntry, problem_reference, problem_schema};
pub use fix::{Fix, Fixed, NoFix};
pub use gauge::{GaugeSetup, GaugeSimulator};
pub use implement::Implementation;
pub use init::first_problem;
pub use plan::{
    Planned, PlannedRun, Rehearsal, Rehearsed, Shown, plan, plan_with, rehearse, rehearse_with,
};
pub use predict::{PAUSE_S, PredictedOutput, PredictedTrial, Prediction, predict, predict_with};
pub use problem::{Diagnosable, Problem, Reading, name_of};
pub use ranges::{RangeParameter, RangeSet, Ranges};
pub use rig::{RigSession, RigSetup, RigSimulator};
pub use sensors::sensors;
pub use stretch_data::EffectEntry;
pub use stretch_effects::{KINDS, Kind, Language, Side, kind_named};
pub use stretch_sim::Tolerance;
pub use words::{effect_in_words, in_words, notation};
