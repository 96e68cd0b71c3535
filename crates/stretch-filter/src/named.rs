//! Which estimator of a calibration a design is.

use stretch_core::{RateEstimator, SampleRate};

/// A design that gives the rate of a signal, and knows which estimator of a calibration it is.
///
/// A receptor refuses a design that is not the estimator with which its calibration was fitted. A design that no
/// calibration can name, such as one of your own, is not compared: implement the trait without its function.
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

/// Rates that are known already.
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
