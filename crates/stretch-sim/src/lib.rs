#![doc = include_str!("../README.md")]

mod backlash;
mod effects;
mod error;
mod grid;
mod memory;
mod nearest;
mod operator;
mod params;
mod skew;
mod stage;
mod stages;
mod static_law;

pub use effects::{
    Action, ActiveEffect, CATALOGUE, Effect, EffectParameter, EffectSet, Scale, Surroundings,
    effect_named,
};
pub use error::SimError;
pub use grid::{DEFAULT_STEP_S, Grid};
pub use memory::Memory;
pub use operator::{
    Backlash, Droop, Hysteresis, Law, MeanReversion, Operator, Span, Start, play, soft_ceiling,
    soft_floor,
};
pub use params::{Key, PARAMETERS, ParameterInfo, RigParams, Tolerance};
pub use stage::Stage;
pub use stages::{
    Actuation, Bridge, Chain, ChainMemory, Muscle, Openings, Pneumatics, Recorded, Reference,
    Sensing,
};
pub use static_law::StaticLaw;
