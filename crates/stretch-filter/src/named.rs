//! The relation between a filter design and the rate estimator that a calibration names.

use stretch_core::{RateEstimator, SampleRate};

/// A filter design that computes the rate of a signal, and knows under which name and parameters a calibration stores
/// it.
///
/// A receptor refuses a design if its calibration was fitted with another estimator. No calibration can name a design
/// of your own: for it, write an empty implementation of the trait, and the receptor then accepts the design without
/// this check.
///
/// ```
/// use stretch_core::{RateEstimator, SampleRate};
/// use stretch_filter::{NamedRate, SgRate};
/// let hz = SampleRate::new(100.0)?;
/// let rate = SgRate::<f32, 11, 2>::new(hz)?;
/// assert_eq!(rate.named(), Some((RateEstimator::SAVGOL_11_2, hz)));
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
pub trait NamedRate {
    /// Returns the estimator and the sample rate for which it was designed; `None` if no calibration can name it.
    fn named(&self) -> Option<(RateEstimator, SampleRate)> {
        None
    }
}

/// No estimator: the caller passes the rate.
impl NamedRate for () {}

/// Returns the name of a Savitzky-Golay design of derivative order 1.
pub(crate) fn savitzky_golay(
    window: usize,
    degree: usize,
    delay: usize,
    sample_rate: SampleRate,
) -> Option<(RateEstimator, SampleRate)> {
    let estimator = RateEstimator::SavitzkyGolay {
        window: window.try_into().ok()?,
        degree: degree.try_into().ok()?,
        delay: delay.try_into().ok()?,
    };
    Some((estimator, sample_rate))
}
