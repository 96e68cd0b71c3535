#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod effects;
mod error;
mod gauge;
mod params;
mod protocol;
mod random;
mod rig;
mod session;
mod stages;
mod static_law;

pub use effects::{ActiveEffect, CATALOGUE, Catalogue, EffectSet, effect_named};
pub use error::SimError;
pub use gauge::{Gauge, GaugeRig, GaugeSpec};
pub use params::{Key, PARAMETERS, ParameterInfo, RigParams, Tolerance};
pub use protocol::{OPENINGS, PAUSE_S, RATE_HZ, TrialPlan, excitation_share};
pub use rig::{LEAST_STRAIN, Rig, RunSettings, default_rig_text, demo_preset, paper_preset};
pub use session::Session;
pub use stages::{
    Actuation, Bridge, Chain, ChainMemory, Held, Memory, Muscle, Openings, Pneumatics, Recorded,
    Reference, Sensing, Setting,
};
pub use static_law::{StaticLaw, static_kpa};
pub use stretch_effects::{
    Action, Acts, Alone, Cell, Constant, DEFAULT_STEP_S, Droop, Effect, EffectParameter, Extent,
    Find, Form, Grid, GridError, Language, Law, Line, Live, Measured, Need, Operator, Place,
    Quantity, RigStage, Role, Scale, Search, Sketch, Span, Start, Starts, Surroundings,
};
