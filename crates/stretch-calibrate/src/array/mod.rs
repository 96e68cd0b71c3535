//! Calibrations of several gauges that share a recorder.
//!
//! [`calibrate_array`] fits one linear model of all channels and their memories; the same [`Linear`] comes of a prior.
//! A [`SleeveCalibration`] is its record: of one channel a calibration like any other, of several an
//! [`ArrayCalibration`](stretch_core::ArrayCalibration) that holds the gains for every channel that may be lost.

mod apply;
mod carried;
mod fit;
mod linear;
mod parted;
mod record;
mod shifts;
mod still;
mod watch;

pub use apply::{AppliedArray, apply_array};
pub use carried::Carried;
pub use fit::{ArrayFit, ArrayOptions, calibrate_array};
pub use linear::{ROOM, SleeveCalibration};
pub use record::{array_bytes, array_seal};

pub(crate) use linear::Linear;
pub(crate) use still::Still;
pub(crate) use watch::watched;
