//! Checks that are common to all functions on logs.

use crate::{FilterError, sample};
use stretch_core::Real;

/// Fails for the first sample that is NaN or beyond `LARGEST_SAMPLE`.
pub(super) fn check_samples<T: Real>(log: &[T]) -> Result<(), FilterError> {
    match log.iter().position(|&x| !sample::usable(x)) {
        Some(index) => Err(FilterError::NotFinite { index }),
        None => Ok(()),
    }
}

/// Fails unless there is one finite time for each sample and the times increase.
pub(super) fn check_times<T: Real>(times_s: &[f64], log: &[T]) -> Result<(), FilterError> {
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
