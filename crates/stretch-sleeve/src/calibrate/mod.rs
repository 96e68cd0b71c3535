//! Calibrations of sleeves (wearable gauges) from trials, and their files.
//!
//! [`calibrate_array`] fits one linear model of all channels and their memories. A [`Prior`] is
//! learnt from earlier sessions and gives the same kind of model, [`Linear`](linear::Linear).
//! [`find_turns`] finds the turning points of the movements of a single gauge.

mod array;
mod bank;
mod channels;
mod error;
mod gauge;
mod linear;
mod options;
mod prior;
mod record;
mod turns;

pub use array::{
    AppliedArray, ArraySummary, Carried, apply_array, calibrate_array, evaluate_arrays,
};
pub use error::SleeveError;
pub use gauge::{AppliedGauge, LiveGauge, apply_gauge};
pub use options::{SleeveFit, SleeveOptions};
pub use prior::{Assumed, Expected, Prior, RenewSummary, Session, UpdateSummary};
pub use record::{
    RecordSummary, SleeveCalibration, array_bytes, array_seal, describe_record, seal_record,
};
pub use turns::{calibrate_gauge, find_turns, missing_turns};
