//! Calibrations of several gauges that share a recorder.

mod apply;
mod carried;
mod fit;
mod parted;
mod shifts;
mod still;
mod watch;

pub use apply::{AppliedArray, apply_array};
pub use carried::Carried;
pub use fit::{ArrayFit, ArrayOptions, calibrate_array};

pub(crate) use still::Still;
pub(crate) use watch::watched;
