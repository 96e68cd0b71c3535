//! Delay of an estimate behind the truth.

use stretch_core::Real;

use crate::MetricsError;

/// The lag at which the correlation of truth and estimate is greatest.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lag {
    /// Number of samples by which the estimate lags behind the truth, interpolated by a parabola; negative if the
    /// estimate leads. Multiply by the sampling interval to get seconds.
    pub samples: f64,
    /// Pearson's correlation at the best whole lag.
    pub correlation: f64,
    /// Pearson's correlation at lag 0. If it is only a little below `correlation`, the lag has
    /// little effect, or the signals hardly determine it (a single ramp correlates with itself at
    /// any lag).
    pub correlation_at_zero: f64,
    /// Whether the best lag is the largest that was tried, so that the true lag may be larger.
    pub at_limit: bool,
}

/// Estimates the lag of `estimate` behind `truth`, by normalised cross-correlation.
///
/// For each whole lag k from `-max_lag` to `max_lag`, r(k) is Pearson's correlation of `truth[i]` with `estimate[i +
/// k]` over the overlapping samples. Means and scales are computed for each overlap, so offset, gain and the length of
/// the overlap do not bias the result. The function takes the greatest r(k); if two are equal, the one with the smaller
/// |k|. A parabola through this value and its two neighbours gives the position of the peak between samples. Both
/// signals must be sampled uniformly, at the same times. The cost is `n (2 max_lag + 1)` steps of five multiply-adds,
/// without extra memory.
///
/// # Errors
/// [`MetricsError`] if the lengths differ, a sample is not finite, either signal is
/// constant, or fewer than `2 max_lag + 3` samples are given (every overlap must contain more
/// than half of them).
///
/// ```
/// let truth: [f64; 200] = core::array::from_fn(|i| libm::sin(0.1 * i as f64));
/// let estimate: [f64; 200] = core::array::from_fn(|i| 3.0 + libm::sin(0.1 * (i as f64 - 2.5)));
/// let lag = stretch_metrics::lag(&truth, &estimate, 10)?;
/// approx::assert_abs_diff_eq!(lag.samples, 2.5, epsilon = 0.01);
/// # Ok::<(), stretch_metrics::MetricsError>(())
/// ```
pub fn lag<T: Real>(truth: &[T], estimate: &[T], max_lag: usize) -> Result<Lag, MetricsError> {
    let n = truth.len();
    if estimate.len() != n {
        return Err(MetricsError::Lengths { truth: n, estimate: estimate.len() });
    }
    let needed = max_lag.saturating_mul(2).saturating_add(3);
    if n < needed {
        return Err(MetricsError::TooFew { needed: needed as u64, got: n as u64 });
    }
    let truth = Signal::new("truth", truth)?;
    let estimate = Signal::new("estimate", estimate)?;
    let at = |k: isize| correlation(&truth, &estimate, k);
    let zero = at(0);
    let (mut best, mut peak) = (0, zero);
    for k in 1..=max_lag.cast_signed() {
        for k in [k, -k] {
            let r = at(k);
            if r > peak {
                (best, peak) = (k, r);
            }
        }
    }
    let at_limit = max_lag > 0 && best.unsigned_abs() == max_lag;
    // For a lag of one sample beyond the limit, the overlap still contains more than half of the samples.
    let (before, after) = (at(best - 1), at(best + 1));
    let bend = before - 2.0 * peak + after;
    let within = before <= peak && after <= peak && bend < 0.0;
    let shift = if within { 0.5 * (before - after) / bend } else { 0.0 };
    let samples = best as f64 + shift;
    Ok(Lag { samples, correlation: peak, correlation_at_zero: zero, at_limit })
}

/// A signal with a centre and scale that bring it to -1..1, so that products neither cancel nor
/// overflow.
struct Signal<'a, T> {
    samples: &'a [T],
    centre: f64,
    scale: f64,
}

impl<'a, T: Real> Signal<'a, T> {
    fn new(name: &'static str, samples: &'a [T]) -> Result<Self, MetricsError> {
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for (index, x) in samples.iter().enumerate() {
            if !x.is_finite() {
                return Err(MetricsError::NotFinite { index });
            }
            (min, max) = (min.min(x.as_f64()), max.max(x.as_f64()));
        }
        let half = max / 2.0 - min / 2.0;
        if half <= 0.0 {
            return Err(MetricsError::Constant { signal: name });
        }
        // The scale of a subnormal range would overflow.
        let scale = (1.0 / half).min(f64::MAX);
        Ok(Self { samples, centre: min / 2.0 + max / 2.0, scale })
    }

    fn centred(&self, x: T) -> f64 {
        (x.as_f64() - self.centre) * self.scale
    }
}

/// Returns Pearson's correlation of `truth[i]` and `estimate[i + k]` over the overlap; 0 if either
/// is constant in the overlap.
fn correlation<T: Real>(truth: &Signal<'_, T>, estimate: &Signal<'_, T>, k: isize) -> f64 {
    let n = truth.samples.len();
    let size = k.unsigned_abs().min(n);
    let (t, e) = if k >= 0 { (0..n - size, size..n) } else { (size..n, 0..n - size) };
    let [mut x, mut y, mut xx, mut yy, mut xy] = [0.0; 5];
    for (&a, &b) in truth.samples[t].iter().zip(&estimate.samples[e]) {
        let (a, b) = (truth.centred(a), estimate.centred(b));
        x += a;
        y += b;
        xx += a * a;
        yy += b * b;
        xy += a * b;
    }
    let count = (n - size) as f64;
    let (sx, sy) = (xx - x * x / count, yy - y * y / count);
    // A spread below this is rounding error of the sums.
    let least = 1e-12 * count;
    if !(sx > least && sy > least) {
        return 0.0;
    }
    ((xy - x * y / count) / (libm::sqrt(sx) * libm::sqrt(sy))).clamp(-1.0, 1.0)
}
