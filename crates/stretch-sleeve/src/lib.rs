#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(not(feature = "calibrate"), no_std)]

mod array_calibration;
#[cfg(feature = "calibrate")]
mod calibrate;
mod example;
mod gauge_calibration;
mod live;

pub use array_calibration::{
    ARRAY_RELAXATIONS, ARRAY_STATES, ARRAY_TERMS, ArrayCalibration, ArrayChannel, ArrayGains,
    ArrayShifts, ArraySpec, MAX_CHANNELS,
};
#[cfg(feature = "calibrate")]
pub use calibrate::*;
pub use example::example_array;
pub use gauge_calibration::{GaugeCalibration, Turns};
pub use live::{
    ArrayChannelNumbers, ArrayGainNumbers, ArrayLoss, ArrayMemory, ArrayNumbers, ArrayReading,
    ArrayReceptor, ArrayWithheld, JUMP_SAMPLES, Jump, Repeats, ShiftMemory, ShiftWatch, Shifts,
    TurnFinder, TurnMemory, Zero, ZeroMemory, ZeroWatch, block_of, samples_a_tick,
};
