//! Whole logs: estimators that may look ahead, and honest ways with uneven time stamps.
//!
//! | time stamps | use |
//! | --- | --- |
//! | even | [`SgFilter::over_log`](crate::SgFilter::over_log), or [`central_difference`] as the paper did |
//! | uneven | [`local_polynomial`]: a fit at the actual times |
//! | uneven, and an even grid is needed | [`resample`] first, at no finer a grid than the log has |
//!
//! Every function writes into the caller's slice and allocates nothing.

mod central;
mod local;
mod resample;

pub use central::central_difference;
pub use local::{LocalFit, local_polynomial};
pub use resample::{Between, Grid, resample};

use crate::{FilterError, sample};
use stretch_core::Real;

/// Fails for the first sample that is not usable.
fn check_samples<T: Real>(log: &[T]) -> Result<(), FilterError> {
    match log.iter().position(|&x| !sample::usable(x)) {
        Some(index) => Err(FilterError::NotFinite { index }),
        None => Ok(()),
    }
}

/// Fails unless there is one finite time for each sample and the times increase.
fn check_times<T: Real>(times_s: &[f64], log: &[T]) -> Result<(), FilterError> {
    if times_s.len() != log.len() {
        return Err(FilterError::LengthsDiffer { log: log.len(), other: times_s.len() });
    }
    check_samples(times_s)?;
    for (i, pair) in times_s.windows(2).enumerate() {
        let (before_s, time_s) = (pair[0], pair[1]);
        if time_s <= before_s {
            return Err(FilterError::NotIncreasing { index: i + 1, before_s, time_s });
        }
    }
    check_samples(log)
}
