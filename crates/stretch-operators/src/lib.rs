#![doc = include_str!("../README.md")]
#![no_std]

extern crate alloc;

mod bow;
mod dead_band;
mod drift;
mod fading;
mod grid;
mod hum;
mod knees;
mod lowpass;
mod mean_reversion;
mod operator;
mod oscillator;
mod play;
mod play_start;
mod prandtl_ishlinskii;
mod quantiser;
mod row;
mod skew;
mod softening;
mod unplay;
mod warming;

pub use bow::{Bow, BowedGain, bow};
pub use dead_band::DeadBand;
pub use drift::Drift;
pub use fading::{FadingMemory, Times};
pub use grid::{DEFAULT_STEP_S, Grid, GridError};
pub use hum::Hum;
pub use knees::{Knees, soft_ceiling, soft_floor};
pub use lowpass::{Lowpass, Poles};
pub use mean_reversion::MeanReversion;
pub use operator::{Operator, Span, Start};
pub use oscillator::{Oscillator, Swing};
pub use play::Backlash;
pub use prandtl_ishlinskii::{Loops, PrandtlIshlinskii};
pub use quantiser::Quantiser;
pub use row::Row;
pub use skew::{Skew, SkewSpec};
pub use softening::Softening;
pub use stretch_core::play;
pub use warming::Warming;
