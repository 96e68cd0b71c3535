//! Limits on samples and sample rates.

use stretch_core::{DesignError, Real, SampleRate};

/// The largest magnitude that a sample may have, in the sample's unit: 1e18.
///
/// A larger sample is treated like a NaN: it never enters a memory. Because the sample rate is
/// bounded by [`MAX_SAMPLE_RATE_HZ`], every sum in an estimator then stays finite, even in `f32`.
pub const LARGEST_SAMPLE: f64 = 1e18;

/// The slowest sample rate of a design, in hertz: about one sample in 30 years.
pub const MIN_SAMPLE_RATE_HZ: f64 = 1e-9;

/// The fastest sample rate of a design, in hertz.
pub const MAX_SAMPLE_RATE_HZ: f64 = 1e9;

/// Returns whether a sample may enter a memory: it is neither NaN nor beyond [`LARGEST_SAMPLE`].
#[inline(always)]
pub(crate) fn usable<T: Real>(x: T) -> bool {
    // A single comparison, which is also false for NaN.
    x.abs() <= T::from_f64(LARGEST_SAMPLE)
}

/// Returns the sample rate if it is within the limits.
pub(crate) fn checked_rate(rate: SampleRate) -> Result<SampleRate, DesignError> {
    let holds = (MIN_SAMPLE_RATE_HZ..=MAX_SAMPLE_RATE_HZ).contains(&rate.hz());
    DesignError::check("sample_rate_hz", rate.hz(), holds).map(|_| rate)
}

/// Returns the number of samples in which a transient that shrinks by the factor `radius` per
/// sample falls to 1/200, plus one for the first difference.
pub(crate) fn settling(radius: f64) -> u32 {
    let samples = libm::ceil(libm::log(0.005) / libm::log(radius));
    // The cast saturates. Radius 0 gives 0.
    (samples as u32).saturating_add(1)
}
