#![doc = include_str!("../README.md")]

mod diagnose;
mod evidence;
mod fit;
mod missing;
mod numerics;
mod options;
mod problem;
mod record;
mod search;
mod verdict;

#[cfg(test)]
extern crate self as stretch_gap;
/// Toy simulators of the integration tests, shared with the unit tests.
#[cfg(test)]
#[path = "../tests/toys/mod.rs"]
mod toys;

pub use diagnose::diagnose;
pub use evidence::{
    candidates::{Candidate, EffectValue, ParameterShift},
    detection_limit::DetectionLimit,
    gathered::{Evidence, Excess, StageEvidence},
    localise::location::{SliceGap, StageGap, StageShare, Where},
    probability::covering,
    responses::{Answered, Response, Responses},
    shares::EffectShare,
    stability::EffectStability,
};
pub use fit::{
    identifiability::{Identified, Knowledge},
    sample_fit::{SampleFit, SampleValue, fit_samples},
    spread::{Known, Place, Spread},
    starts::Starts,
};
pub use missing::{Course, Factor, Passage, Proposed, ProposedTerm, RateForm, SignalScale, Term};
pub use numerics::random::RandomGenerator;
pub use options::{Options, cap_threads, threads};
pub use problem::{
    checks::DescriptionError,
    column::{Column, Distortion},
    description::{Description, DescriptionSpec},
    error::GapError,
    noise::{Noise, WINDOW, noise_variance},
    record_facts::{Motion, MotionSpec, RecordFacts, Recorded, RowsUsed, nouns},
    sample_roles::{BLOCK_S, Role, SampleRoles, Segment},
    simulator::{Model, ModelRuns, Run, Simulator},
    spec::{EffectSpec, ParameterSpec, SlowDrift, StageSpec, TrialSpec},
    spectral_line::Line,
    thresholds::Thresholds,
};
pub use record::{
    columns_alone::copied,
    gross::{Gross, GrossKind},
    units::units_of_factor,
};
pub use stretch_effects::EffectParameter;
pub use verdict::{
    answer::{Answer, Closed, MissingEffect},
    coverage::TooLittle,
    diagnosis::{Diagnosis, NextExperiment, Transfer, TransferError, Unexplained, VerdictKind},
    family::EffectFamily,
    next_experiment::{Laboratory, Plan, Proposal, differences, next_experiment},
    note::{Note, NoteCode},
};
