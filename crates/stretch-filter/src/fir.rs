//! The transposed finite impulse response filter on which all Savitzky-Golay filters run.

use stretch_core::Real;

/// Processes the sample `x` and returns the output. `taps` are ordered from the newest sample to
/// the oldest.
///
/// `state[j]` holds the contribution of the samples so far to the output j + 1 steps from now. Its
/// last element stays zero. Every partial sum leaves the state after `taps.len()` steps, so that no
/// rounding accumulates.
#[inline(always)]
pub(crate) fn step<T: Real>(taps: &[T], state: &mut [T], x: T) -> T {
    let n = taps.len().min(state.len());
    let (taps, state) = (&taps[..n], &mut state[..n]);
    let (Some(&first), Some(&sum)) = (taps.first(), state.first()) else { return T::zero() };
    for j in 1..n {
        state[j - 1] = state[j] + taps[j] * x;
    }
    sum + first * x
}

/// Sets the state to the steady state for the constant input `x`.
pub(crate) fn settle<T: Real>(taps: &[T], state: &mut [T], x: T) {
    let mut sum = T::zero();
    for (slot, &tap) in state.iter_mut().zip(taps).rev() {
        *slot = sum;
        sum = sum + tap * x;
    }
}

/// Returns the standard deviation of the output for white input noise of standard deviation 1.
pub(crate) fn noise_gain<T: Real>(taps: &[T]) -> f64 {
    libm::sqrt(taps.iter().map(|h| h.as_f64() * h.as_f64()).sum())
}

/// Returns the delay of the `order`-th derivative for slow signals, in samples: minus the output
/// for x(t) = t^(order+1)/(order+1)! at t = 0.
///
/// `unit` is the factor that removes the scale of the taps.
pub(crate) fn delay_samples<T: Real>(taps: &[T], order: usize, unit: f64) -> f64 {
    let mut sum = 0.0;
    for (lag, tap) in taps.iter().enumerate() {
        let t = -(lag as f64);
        let term: f64 = (1..=order + 1).map(|k| t / k as f64).product();
        sum -= tap.as_f64() * unit * term;
    }
    sum
}
