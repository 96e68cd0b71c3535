//! Whole logs: estimators that may look ahead, and honest ways with uneven time stamps.
//!
//! | time stamps | use |
//! | --- | --- |
//! | even | [`SgFilter::over_log`](crate::SgFilter::over_log), or [`central_difference`] as the paper did |
//! | uneven | [`local_polynomial`]: a fit at the actual times |
//! | uneven, and an even grid is needed | [`resample`] first, at no finer a grid than the log has |
//!
//! [`noise_of_differences`] gives the noise of a log, whatever the motion in the log.
//!
//! Every function writes into the caller's slice and allocates nothing.

mod central;
mod check;
mod local;
mod noise;
mod resample;

pub use central::central_difference;
pub use local::{LocalFit, local_polynomial};
pub use noise::{noise_of_differences, second_differences};
pub use resample::{Between, Grid, resample};
