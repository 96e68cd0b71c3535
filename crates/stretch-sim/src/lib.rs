#![doc = include_str!("../README.md")]

mod effects;
mod error;
mod gauge;
mod gauge_file;
mod law;
mod memory;
mod nearest;
mod params;
mod preset;
mod protocol;
mod random;
mod rig;
mod session;
mod sketch;
mod stage;
mod stages;
mod static_law;

pub use effects::{
    Action, ActiveEffect, Alone, CATALOGUE, Catalogue, Effect, EffectParameter, EffectSet, Extent,
    Find, Form, Line, Measured, Need, Role, Scale, Search, Starts, Surroundings, effect_named,
};
pub use error::SimError;
pub use gauge::{Gauge, GaugeSpec};
pub use gauge_file::GaugeRig;
pub use law::{Droop, Law};
pub use memory::Memory;
pub use params::{Key, PARAMETERS, ParameterInfo, RigParams, Tolerance};
pub use preset::paper_preset;
pub use protocol::{OPENINGS, PAUSE_S, RATE_HZ, TrialPlan};
pub use rig::{LEAST_STRAIN, Rig, RunSettings, default_rig_text};
pub use session::Session;
pub use sketch::{Cell, Constant, Language, Quantity, Sketch};
pub use stage::Stage;
pub use stages::{
    Actuation, Bridge, Chain, ChainMemory, Held, Muscle, Openings, Pneumatics, Recorded, Reference,
    Sensing, Setting,
};
pub use static_law::StaticLaw;
pub use stretch_effects::{DEFAULT_STEP_S, Grid, GridError, Operator, Span, Start};
