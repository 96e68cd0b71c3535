//! Calibrations of several gauges that share a recorder.

mod apply;
mod fit;
mod parted;
mod shifts;
mod watch;

pub use apply::{AppliedArray, apply_array, evaluate_arrays};
pub use fit::{ArraySummary, calibrate_array};
pub use parted::Carried;

pub(crate) use watch::{Still, watched};
