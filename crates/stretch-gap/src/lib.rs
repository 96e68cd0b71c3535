#![doc = include_str!("../README.md")]

mod altered;
mod baselines;
mod bootstrap;
mod description;
mod diagnose;
mod diagnosis;
mod dice;
mod error;
mod evidence;
mod fit;
mod floor;
mod frame;
mod linear;
mod localise;
mod next_experiment;
mod probability;
mod sanity;
mod screen;
mod select;
mod shares;
mod simulator;
mod spec;
mod thresholds;
mod transfer;
mod verdict;

pub use description::{Description, DescriptionError, DescriptionSpec};
pub use diagnose::{Options, diagnose};
pub use diagnosis::{
    Baselines, Candidate, Diagnosis, EffectValue, Excess, NextExperiment, ParameterShift, SliceGap,
    StageGap, StageShare, Transfer, TransferError, VerdictKind, Where,
};
pub use dice::Dice;
pub use error::GapError;
pub use evidence::{Evidence, StageEvidence};
pub use floor::noise_variance;
pub use frame::{BLOCK_S, Frame, Metric, Role, Segment};
pub use next_experiment::{Laboratory, Plan, Proposal, differences, next_experiment};
pub use shares::EffectShare;
pub use simulator::{Model, Motion, Run, Simulator};
pub use spec::{EffectParameterSpec, EffectSpec, ParameterSpec, StageSpec, TrialSpec, Wander};
pub use thresholds::Thresholds;
