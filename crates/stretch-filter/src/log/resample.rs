//! Resampling from uneven times to an even grid.

use super::check::check_times;
use crate::FilterError;
use stretch_core::{DesignError, Real, SampleRate, Seconds};

/// An even grid of times: `start`, then one point per period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Time of the first point.
    pub start: Seconds,
    /// Points per second.
    pub sample_rate: SampleRate,
}

impl Grid {
    /// Returns the time of point `index`, in seconds.
    pub fn time_s(&self, index: usize) -> f64 {
        self.start.0 + index as f64 * self.sample_rate.period_s()
    }

    /// Returns the number of points up to and including `last`; zero if `last` is before the start.
    pub fn points_until(&self, last: Seconds) -> usize {
        let periods = (last.0 - self.start.0) * self.sample_rate.hz();
        if periods < 0.0 {
            return 0;
        }
        // The cast saturates. The adjustments below correct the rounding of the product.
        let mut points = (periods as usize).saturating_add(1);
        if self.time_s(points) <= last.0 {
            points += 1;
        }
        while points > 0 && self.time_s(points - 1) > last.0 {
            points -= 1;
        }
        points
    }
}

/// Interpolation method of [`resample`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Between {
    /// The line through the two neighbouring samples, which never leaves their range.
    Linear,
    /// The cubic through four neighbouring samples, or a lower degree through all samples of a log
    /// with two or three. Exact for a cubic; may overshoot at a corner.
    Cubic,
}

/// Resamples an unevenly sampled log onto an even grid of `out.len()` points.
///
/// Interpolation colours noise. A grid finer than the log adds no information, and a point within a
/// long gap is a guess. Prefer [`local_polynomial`](super::local_polynomial) if you need only the
/// rate.
///
/// # Errors
/// [`FilterError::TooShort`] below two samples, [`FilterError::LengthsDiffer`],
/// [`FilterError::NotFinite`], [`FilterError::NotIncreasing`]; [`FilterError::OutsideLog`] if the
/// grid extends beyond the log, because nothing is extrapolated; [`FilterError::Design`] for a
/// start that is not finite. `out` is then unchanged.
///
/// ```
/// use stretch_core::{SampleRate, Seconds};
/// use stretch_filter::log::{Between, Grid, resample};
///
/// let times = [0.0, 0.011, 0.019, 0.03];
/// let log = times.map(|t| 2.0 * t);
/// let grid = Grid { start: Seconds(0.0), sample_rate: SampleRate::new(100.0).unwrap() };
/// let mut even = [0.0; 4];
/// assert_eq!(grid.points_until(Seconds(0.03)), 4);
/// resample(&times, &log, grid, Between::Linear, &mut even).unwrap();
/// approx::assert_abs_diff_eq!(even[2], 0.04_f64, epsilon = 1e-15);
/// ```
pub fn resample<T: Real>(
    times_s: &[f64],
    log: &[T],
    grid: Grid,
    between: Between,
    out: &mut [T],
) -> Result<(), FilterError> {
    check_times(times_s, log)?;
    let n = log.len();
    if n < 2 {
        return Err(FilterError::TooShort { needed: 2, got: n });
    }
    DesignError::check("start_s", grid.start.0, true)?;
    let (first_s, last_s) = (times_s[0], times_s[n - 1]);
    for index in [0, out.len().saturating_sub(1)] {
        let time_s = grid.time_s(index);
        if !out.is_empty() && !(first_s..=last_s).contains(&time_s) {
            return Err(FilterError::OutsideLog { time_s, first_s, last_s });
        }
    }
    let mut left = 0;
    for (index, y) in out.iter_mut().enumerate() {
        let time_s = grid.time_s(index);
        while left + 2 < n && times_s[left + 1] <= time_s {
            left += 1;
        }
        *y = match between {
            Between::Linear => neville(&times_s[left..left + 2], &log[left..left + 2], time_s),
            Between::Cubic => {
                let count = n.min(4);
                let from = left.saturating_sub(1).min(n - count);
                neville(&times_s[from..from + count], &log[from..from + count], time_s)
            }
        };
    }
    Ok(())
}

/// Evaluates the polynomial through at most four points, by Neville's scheme.
fn neville<T: Real>(times: &[f64], values: &[T], at_s: f64) -> T {
    let mut p = [0.0; 4];
    for (p, x) in p.iter_mut().zip(values) {
        *p = x.as_f64();
    }
    for width in 1..times.len() {
        for i in 0..times.len() - width {
            let (left, right) = (times[i], times[i + width]);
            p[i] += (at_s - left) / (right - left) * (p[i + 1] - p[i]);
        }
    }
    T::from_f64(p[0])
}
