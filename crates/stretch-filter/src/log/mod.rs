//! Estimators for whole logs, which may use future samples, and functions for uneven time stamps.
//!
//! | time stamps | use |
//! | --- | --- |
//! | even | [`SgFilter::over_log`](crate::SgFilter::over_log), or [`central_difference`] as in the published method |
//! | uneven | [`local_polynomial`]: a fit at the actual times |
//! | uneven, and an even grid is needed | [`resample`] first, at no finer a grid than the log has |
//!
//! [`noise_of_differences`] estimates the noise of a log and is robust to motion in the log.
//!
//! The functions allocate nothing. Those with an output series write it to the caller's slice.

mod central;
mod check;
mod local;
mod noise;
mod resample;

pub use central::central_difference;
pub use local::{LocalFit, local_polynomial};
pub use noise::{noise_of_differences, second_differences};
pub use resample::{Between, Grid, resample};
