#![doc = include_str!("../README.md")]

mod altered;
mod arrow;
mod as_is;
mod baselines;
mod bootstrap;
mod candidates;
mod compare;
mod coordinate;
mod coverage;
mod description;
mod diagnose;
mod diagnosis;
mod dice;
mod ends;
mod error;
mod evidence;
mod fit;
mod floor;
mod frame;
mod hyper;
mod hypothesis;
mod identify;
mod judge;
mod lacking;
mod line;
mod linear;
mod linked;
mod localise;
mod lone;
mod metric;
mod missing;
mod naming;
mod next_experiment;
mod noise;
mod nuisance;
mod null_band;
mod octaves;
mod probability;
mod problem;
mod record;
mod response;
mod responses;
mod rows;
mod runs;
mod sanity;
mod score;
mod screen;
mod search;
mod sets;
mod settle;
mod shares;
mod simulator;
mod spec;
mod stopwatch;
mod thin;
mod thresholds;
mod timing;
mod transfer;
mod words;
mod worth;

pub use description::{Description, DescriptionError, DescriptionSpec};
pub use diagnose::{Options, diagnose};
pub use diagnosis::{
    Baselines, Candidate, Diagnosis, EffectShare, EffectValue, Excess, Gross, GrossKind,
    NextExperiment, ParameterShift, SliceGap, StageGap, StageShare, Transfer, TransferError,
    Unexplained, VerdictKind, Where,
};
pub use dice::Dice;
pub use error::GapError;
pub use evidence::{Evidence, StageEvidence};
pub use frame::{BLOCK_S, Frame, Role, Segment};
pub use identify::{Identified, Knowledge};
pub use line::Line;
pub use missing::{Factor, Passage, Proposed, ProposedTerm, RateForm, SignalScale, Term};
pub use next_experiment::{Laboratory, Plan, Proposal, differences, next_experiment};
pub use noise::{Noise, WINDOW, noise_variance};
pub use record::{
    column::{Column, Distortion},
    plain::copied,
};
pub use response::{Answered, Response, Responses};
pub use rows::RowsUsed;
pub use simulator::{Model, ModelRuns, Motion, Recorded, Run, Simulator};
pub use spec::{EffectParameterSpec, EffectSpec, ParameterSpec, StageSpec, TrialSpec, Wander};
pub use thresholds::Thresholds;
