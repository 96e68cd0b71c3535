//! Local least-squares fits at the actual times of the samples.

use super::check::check_times;
use crate::gram::Basis;
use crate::{FilterError, MAX_SG_DEGREE};
use stretch_core::{DesignError, Real, Seconds};

/// Parameters of [`local_polynomial`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalFit {
    /// Samples in the window around each sample; odd.
    pub window: usize,
    /// Degree of the polynomial, below `window`, at most [`MAX_SG_DEGREE`].
    pub degree: usize,
    /// Derivative: 0 smooths, 1 gives the rate.
    pub order: usize,
    /// A longer interval between two samples is a gap. No window contains a gap.
    pub longest_step: Seconds,
}

impl LocalFit {
    fn check(&self) -> Result<(), DesignError> {
        let Self { window, degree, order, longest_step } = *self;
        if degree > MAX_SG_DEGREE {
            let most = MAX_SG_DEGREE;
            return Err(DesignError::TooLarge { field: "degree", asked: degree, most });
        }
        DesignError::check("window", window as f64, window > degree && window % 2 == 1)?;
        DesignError::check("order", order as f64, order <= degree)?;
        DesignError::check("longest_step_s", longest_step.0, longest_step.0 > 0.0).map(|_| ())
    }
}

/// Computes the value or a derivative of an unevenly sampled log at each of its samples, by a least-squares polynomial
/// through the window around the sample, at the actual times.
///
/// For even times the result equals the centred [`SgFilter::over_log`](crate::SgFilter::over_log). At the ends of the
/// log, and on both sides of a gap, the nearest whole window is used. A segment between two gaps with fewer samples
/// than the window is fitted as a whole. The result is `None` if the segment has no more than `degree` samples, or if
/// its times are too close together to determine the polynomial.
///
/// The polynomials are orthogonal on the times of the window (Forsythe 1957, doi:10.1137/0105007), so no matrix is
/// formed. The cost is O(window degree^2) per sample.
///
/// # Errors
/// [`FilterError::LengthsDiffer`], [`FilterError::NotFinite`] (samples or
/// times), [`FilterError::NotIncreasing`], or [`FilterError::Design`] naming the
/// field of `fit`. `out` is then unchanged.
///
/// ```
/// use stretch_core::Seconds;
/// use stretch_filter::log::{LocalFit, local_polynomial};
///
/// let times = [0.00, 0.01, 0.023, 0.03, 0.044, 0.05];
/// let log = times.map(|t: f64| 1.0 + 5.0 * t * t);
/// let fit = LocalFit { window: 5, degree: 2, order: 1, longest_step: Seconds(0.05) };
/// let mut rate = [None; 6];
/// local_polynomial(fit, &times, &log, &mut rate).unwrap();
/// for (t, rate) in times.iter().zip(rate) {
///     approx::assert_abs_diff_eq!(rate.unwrap(), 10.0 * t, epsilon = 1e-9);
/// }
/// ```
pub fn local_polynomial<T: Real>(
    fit: LocalFit,
    times_s: &[f64],
    log: &[T],
    out: &mut [Option<T>],
) -> Result<(), FilterError> {
    fit.check()?;
    if out.len() != log.len() {
        return Err(FilterError::LengthsDiffer { log: log.len(), other: out.len() });
    }
    check_times(times_s, log)?;
    let mut start = 0;
    while start < times_s.len() {
        let gap = times_s[start..].windows(2).position(|t| t[1] - t[0] > fit.longest_step.0);
        let end = gap.map_or(times_s.len(), |steps| start + steps + 1);
        stretch_between_gaps(fit, &times_s[start..end], &log[start..end], &mut out[start..end]);
        start = end;
    }
    Ok(())
}

fn stretch_between_gaps<T: Real>(fit: LocalFit, times: &[f64], log: &[T], out: &mut [Option<T>]) {
    let n = times.len();
    if n <= fit.degree {
        out.fill(None);
        return;
    }
    let window = fit.window.min(n);
    for (i, y) in out.iter_mut().enumerate() {
        let first = i.saturating_sub(window / 2).min(n - window);
        let range = first..first + window;
        *y = derivative(fit, &times[range.clone()], &log[range], times[i]).map(T::from_f64);
    }
}

/// Returns the derivative at `at_s` of the least-squares polynomial through the window.
///
/// Returns `None` if the times are so close together that, within rounding errors, they do not determine a polynomial
/// of this degree.
fn derivative<T: Real>(fit: LocalFit, times: &[f64], log: &[T], at_s: f64) -> Option<f64> {
    /// A squared norm below this is rounding error. For |u| <= 1, even degree 10 on a one-sided window has norms of
    /// 1e-11.
    const LOST: f64 = 1e-24;
    let scale = (times[times.len() - 1] - at_s).max(at_s - times[0]);
    let unit = if scale > 0.0 { 1.0 / scale } else { 1.0 };
    // Monic polynomials p(k+1) = (u - a(k)) p(k) - b(k) p(k-1).
    let mut a: Basis = Basis::default();
    let mut b: Basis = Basis::default();
    let mut at: Basis = Basis::default();
    let mut at_before: Basis = Basis::default();
    at[0] = 1.0;
    let (mut sum, mut norm_before) = (0.0, 1.0);
    for k in 0..=fit.degree {
        let (mut norm, mut first_moment, mut product) = (0.0, 0.0, 0.0);
        for (&t, &x) in times.iter().zip(log) {
            let u = (t - at_s) * unit;
            let p = value_at(&a, &b, k, u);
            norm += p * p;
            first_moment += u * p * p;
            // The newest sample is subtracted from each value, because a large offset would cost digits.
            product += p * (x.as_f64() - log[log.len() - 1].as_f64());
        }
        if norm <= LOST {
            return None;
        }
        sum += product / norm * at[fit.order];
        a[k] = first_moment / norm;
        b[k] = if k == 0 { 0.0 } else { norm / norm_before };
        norm_before = norm;
        let mut next = Basis::default();
        for s in 0..=fit.order {
            let lower = if s == 0 { 0.0 } else { s as f64 * at[s - 1] };
            next[s] = lower - a[k] * at[s] - b[k] * at_before[s];
        }
        at_before = at;
        at = next;
    }
    if fit.order == 0 {
        sum += log[log.len() - 1].as_f64();
    }
    Some((0..fit.order).fold(sum, |value, _| value * unit))
}

/// Evaluates p(k) at `u` by the recurrence.
fn value_at(a: &Basis, b: &Basis, k: usize, u: f64) -> f64 {
    let (mut before, mut p) = (0.0, 1.0);
    for j in 0..k {
        (before, p) = (p, (u - a[j]) * p - b[j] * before);
    }
    p
}
