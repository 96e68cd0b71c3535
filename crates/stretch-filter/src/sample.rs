//! Which samples and sample rates an estimator takes.

use stretch_core::{DesignError, Real, SampleRate};

/// The largest magnitude that a sample may have, in the sample's unit: 1e18.
///
/// A sample beyond it is treated like a NaN: it never enters a memory. With
/// the sample rate bounded by [`MAX_SAMPLE_RATE_HZ`], every sum that an
/// estimator forms then stays finite, in `f32` too.
pub const LARGEST_SAMPLE: f64 = 1e18;

/// The slowest sample rate of a design, in hertz: a sample in 30 years.
pub const MIN_SAMPLE_RATE_HZ: f64 = 1e-9;

/// The fastest sample rate of a design, in hertz.
pub const MAX_SAMPLE_RATE_HZ: f64 = 1e9;

/// Whether a sample may enter a memory: neither NaN nor beyond [`LARGEST_SAMPLE`].
#[inline(always)]
pub(crate) fn usable<T: Real>(x: T) -> bool {
    // One comparison, false for NaN as well.
    x.abs() <= T::from_f64(LARGEST_SAMPLE)
}

/// The sample rate, when a design can be computed for it.
pub(crate) fn checked_rate(rate: SampleRate) -> Result<SampleRate, DesignError> {
    let holds = (MIN_SAMPLE_RATE_HZ..=MAX_SAMPLE_RATE_HZ).contains(&rate.hz());
    DesignError::check("sample_rate_hz", rate.hz(), holds).map(|_| rate)
}

/// Samples until a transient that shrinks by `radius` each has shrunk to 1/200,
/// and one for the first difference.
pub(crate) fn settling(radius: f64) -> u32 {
    let samples = libm::ceil(libm::log(0.005) / libm::log(radius));
    // A saturating cast: NaN (radius 0) gives none.
    (samples as u32).saturating_add(1)
}
