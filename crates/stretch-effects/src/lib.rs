#![doc = include_str!("../README.md")]
#![no_std]

extern crate alloc;

mod bouc_wen;
mod bow;
mod crosstalk;
mod dead_band;
mod dead_zone;
mod drift;
mod fading;
mod friction;
mod grid;
mod hum;
mod knees;
mod lowpass;
mod mean_reversion;
mod offset;
mod operator;
mod oscillator;
mod play;
mod play_start;
mod prandtl_ishlinskii;
mod quantiser;
mod row;
mod skew;
mod slew_limit;
mod softening;
mod unplay;
mod wandering_line;
mod warming;

pub use bouc_wen::BoucWen;
pub use bow::{Bow, BowedGain, bow};
pub use crosstalk::Crosstalk;
pub use dead_band::DeadBand;
pub use dead_zone::DeadZone;
pub use drift::Drift;
pub use fading::{FadingMemory, Times};
pub use friction::Friction;
pub use grid::{DEFAULT_STEP_S, Grid, GridError};
pub use hum::Hum;
pub use knees::{Knees, soft_ceiling, soft_floor};
pub use lowpass::{Lowpass, Poles};
pub use mean_reversion::MeanReversion;
pub use offset::Offset;
pub use operator::{Operator, Span, Start};
pub use oscillator::{Oscillator, Swing};
pub use play::Backlash;
pub use prandtl_ishlinskii::{Loops, PrandtlIshlinskii};
pub use quantiser::Quantiser;
pub use row::Row;
pub use skew::{Skew, SkewSpec};
pub use slew_limit::SlewLimit;
pub use softening::Softening;
pub use stretch_core::play;
pub use wandering_line::WanderingLine;
pub use warming::Warming;
