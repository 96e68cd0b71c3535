//! Arithmetic steps that give the same bits in a fit on a computer and in a live estimator on a microcontroller.

use core::ops::{Add, Sub};

use crate::Real;

/// Advances a first-order lag by one sample: returns `z + share (x - z)`.
///
/// With `share` from [`lag_share`] the result is exact for an input that is constant at `x` during the sample period.
///
/// ```
/// use stretch_core::arithmetic::{lag, lag_share};
/// let share = lag_share(0.01, 0.1); // 10 ms, of a time constant of 100 ms
/// let z: f64 = (0..10).fold(0.0, |z, _| lag(z, 1.0, share));
/// assert!((z - (1.0 - (-1.0f64).exp())).abs() < 1e-12); // after one time constant
/// ```
#[inline(always)]
#[must_use]
pub fn lag<T: Real>(before: T, x: T, share: T) -> T {
    before + share * (x - before)
}

/// Returns the share of the remaining distance that a lag of time constant `tau_s` covers in `step_s`:
/// `1 - exp(-step_s/tau_s)`. The share is exact for an input that is constant over the step.
///
/// It uses `libm`, so a computer and a microcontroller give the same bits.
///
/// ```
/// assert!((stretch_core::arithmetic::lag_share(1.0, 1.0) - 0.632_120_558_828_557_7).abs() < 1e-15);
/// ```
#[must_use]
pub fn lag_share(step_s: f64, tau_s: f64) -> f64 {
    -libm::expm1(-step_s / tau_s)
}

/// Returns three weights: of the lag's state `z`, of the previous input, and of the new input. The sum of these three
/// numbers, each times its weight, is the new `z`. It is exact if the input changes linearly during the step.
///
/// ```text
/// z_new = w[0] z + w[1] x_before + w[2] x_now,   w[0] = exp(-step_s/tau_s)
/// ```
///
/// Use these weights if the input changes between samples. [`lag`] would then be early by half a sample.
///
/// ```
/// use stretch_core::arithmetic::lag_weights;
/// // a ramp of slope 1 is followed tau behind, for ever
/// let [of_z, of_before, of_now] = lag_weights(0.01, 0.5);
/// let z = of_z * (2.0 - 0.5) + of_before * 2.0 + of_now * 2.01;
/// assert!((z - (2.01 - 0.5)).abs() < 1e-14);
/// ```
#[must_use]
pub fn lag_weights(step_s: f64, tau_s: f64) -> [f64; 3] {
    let a = step_s / tau_s;
    let gone = lag_share(step_s, tau_s);
    // mean of the decay over the step; for small steps it is computed by a series, because the difference would lose
    // digits by cancellation
    let mean = if a < 1e-4 { 1.0 - a * (0.5 - a / 6.0) } else { gone / a };
    [1.0 - gone, mean - (1.0 - gone), 1.0 - mean]
}

/// Advances a play operator (backlash) of half-width `radius`: the output keeps its value until the input pushes it,
/// and then follows `radius` behind the input.
///
/// ```text
/// y = max(x - radius, min(x + radius, y_before))
/// ```
///
/// The function works on floats and integers. It uses only comparisons, one sum and one difference, so every platform
/// gives the same bits. [`HistoryMap`](crate::HistoryMap) and [`ObserverMap`](crate::ObserverMap) use it. Source:
/// Kuhnen 2003, doi:10.3166/ejc.9.407-418.
///
/// ```
/// use stretch_core::arithmetic::play;
/// assert_eq!(play(0.0, 0.5, 1.0), 0.0); // within the play: it stays
/// assert_eq!(play(0.0, 3.0, 1.0), 2.0); // pushed upwards
/// assert_eq!(play(2, -3, 1), -2); // pushed downwards, in integers
/// ```
#[inline(always)]
#[must_use]
pub fn play<T>(before: T, x: T, radius: T) -> T
where
    T: Copy + PartialOrd + Add<Output = T> + Sub<Output = T>,
{
    let (low, high) = (x - radius, x + radius);
    if before < low {
        low
    } else if before > high {
        high
    } else {
        before
    }
}

/// Returns x^n by repeated multiplication, which gives the same bits everywhere: `powi` may differ from platform to
/// platform, and a general power function costs some kilobytes of firmware.
///
/// ```
/// use stretch_core::arithmetic::power;
/// assert_eq!([0, 1, 3].map(|n| power(1.5, n)), [1.0, 1.5, 3.375]);
/// ```
pub fn power(x: f64, n: u8) -> f64 {
    (0..n).map(|_| x).product()
}
