#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![no_std]

extern crate alloc;

mod bow;
mod catalogue;
mod code;
mod crosstalk;
mod dahl;
mod dead_zone;
mod drift;
mod effect;
mod extent;
mod fading;
mod friction;
mod grid;
mod hum;
mod hysteresis;
mod kind;
mod knees;
mod lowpass;
mod moving_mean;
mod operator;
mod oscillator;
mod parameter;
mod place;
mod play;
mod profile;
mod sketch;
mod skew;
mod softening;

pub use bow::{Bow, BowedGain, bow};
pub use catalogue::{GAUGE, KINDS, gauge_effect, kind_named, kinds};
pub use code::Language;
pub use crosstalk::Crosstalk;
pub use dahl::Dahl;
pub use dead_zone::{DeadBand, DeadZone, HoldBand, Quantiser};
pub use drift::{Drift, Offset};
pub use effect::{Acts, Alone, Effect, Live, Need, Search, Target, Values, each, pairs};
pub use extent::Extent;
pub use fading::{FadingMemory, Times, Warming};
pub use friction::{Friction, LoadFriction, TorqueSpeed};
pub use grid::{DEFAULT_STEP_S, Grid, GridError};
pub use hum::{Hum, WanderingLine};
pub use hysteresis::{BoucWen, Loops, PrandtlIshlinskii};
pub use kind::{
    Beside, Family, Find, Kind, Line, Measure, Measured, Side, Signals, Sketched, Starts,
};
pub use knees::{Knees, soft_ceiling, soft_floor};
pub use lowpass::{Lowpass, MeanReversion, Poles};
pub use moving_mean::MovingMean;
pub use operator::{Operator, Row, Span, Start};
pub use oscillator::{FlexibleJoint, Oscillator, Swing};
pub use parameter::{EffectParameter, Form, Role, Scale};
pub use place::{Action, Droop, Law, Place, RigStage, Surroundings};
pub use play::Backlash;
pub use profile::{Profile, SProfile, SlewLimit};
pub use sketch::{Cell, Constant, Quantity, Sketch};
pub use skew::{ClockDrift, Skew, SkewSpec};
pub use softening::Softening;
pub use stretch_core::arithmetic::play;
