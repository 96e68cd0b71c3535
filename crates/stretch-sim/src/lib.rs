#![doc = include_str!("../README.md")]

mod backlash;
mod effects;
mod error;
mod gauge;
mod gauge_file;
mod grid;
mod memory;
mod nearest;
mod operator;
mod params;
mod preset;
mod protocol;
mod random;
mod rig;
mod session;
mod skew;
mod stage;
mod stages;
mod static_law;

pub use effects::{
    Action, ActiveEffect, CATALOGUE, Effect, EffectParameter, EffectSet, Scale, Surroundings,
    effect_named,
};
pub use error::SimError;
pub use gauge::{Gauge, GaugeSpec};
pub use gauge_file::GaugeRig;
pub use grid::{DEFAULT_STEP_S, Grid};
pub use memory::Memory;
pub use operator::{
    Backlash, Droop, Hysteresis, Law, MeanReversion, Operator, Span, Start, play, soft_ceiling,
    soft_floor,
};
pub use params::{Key, PARAMETERS, ParameterInfo, RigParams, Tolerance};
pub use preset::paper_preset;
pub use protocol::{OPENINGS, PAUSE_S, RATE_HZ, TrialPlan};
pub use rig::{LEAST_STRAIN, Rig, RunSettings, default_rig_text};
pub use session::Session;
pub use stage::Stage;
pub use stages::{
    Actuation, Bridge, Chain, ChainMemory, Muscle, Openings, Pneumatics, Recorded, Reference,
    Sensing,
};
pub use static_law::StaticLaw;
