#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

pub mod arithmetic;
mod branch;
mod calibration;
mod degree;
mod diagnosed;
mod error;
pub mod fixed;
mod folded;
mod history;
mod interval;
pub mod label;
mod model;
mod observer;
mod polarity;
mod provenance;
mod range;
mod rate;
mod real;
#[cfg(feature = "serde")]
pub mod record;
mod rest;
mod rest_level;
pub mod sizes;
mod stage;
mod surface;
mod unit;
mod values;

pub use branch::Branch;
pub use calibration::{
    CALIBRATION_SCHEMA, Calibration, CalibrationSpec, RateSource, Schema, Target,
};
pub use degree::{Degree, MAX_DEGREE, MAX_TERMS};
pub use diagnosed::{Crosstalk, DiagnosedMap, Fading, Knee, Plays, Worn};
pub use error::DesignError;
pub use history::{
    HistoryMap, HistoryShape, MAX_HISTORY_TERMS, MAX_PLAYS, MAX_RELAXATIONS, MAX_STATES,
};
pub use interval::Interval;
pub use label::Label;
pub use model::{BranchSurface, LinearMap, Model};
pub use observer::{MAX_KNOTS, MAX_OBSERVER_PLAYS, MAX_OBSERVER_RELAXATIONS, ObserverMap};
pub use polarity::Polarity;
pub use provenance::{FitSummary, Provenance};
pub use range::{Normalisation, Range, RangeSpec};
pub use rate::RateEstimator;
pub use real::Real;
pub use rest::RestTracker;
pub use rest_level::{Baseline, RestLevel};
pub use stage::{Design, Runner, Stage};
pub use surface::{Poly13, Surface};
pub use unit::{Hertz, Millimetres, MillimetresPerSecond, SampleRate, Seconds, Volts};
pub use values::Values;
