//! The subcommands, one file each, and their shared functions.

pub(crate) mod apply;
mod apply_several;
pub(crate) mod calibrate;
mod calibrate_sleeve;
mod calibration_text;
pub(crate) mod compare;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod diagnose;
mod diagnosis_output;
pub(crate) mod effects;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod json;
pub(crate) mod listen;
pub(crate) mod page;
pub(crate) mod plan;
pub(crate) mod problem;
mod reading;
pub(crate) mod shared;
pub(crate) mod simulate;
pub(crate) mod sleeve;
