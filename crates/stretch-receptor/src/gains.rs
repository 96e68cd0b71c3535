//! The stationary gains of a Kalman filter, one set for each of several slopes of the curve.

use stretch_core::{
    DesignError, Interval, MAX_OBSERVER_RELAXATIONS, ObserverMap, arithmetic::lag_share,
};

/// Number of states: the target, its rate, and the relaxations.
pub(crate) const STATES: usize = 2 + MAX_OBSERVER_RELAXATIONS;
/// Number of slopes of the curve for which gains are computed. They are evenly spaced on a logarithmic scale from the
/// flattest to the steepest slope. With twice and eight times as many slopes the errors were the same.
pub(crate) const SLOPES: usize = 12;
/// Largest number of doublings. After `n` doublings the covariance is that after `2^n` samples.
const DOUBLINGS: usize = 30;
/// The doubling ends when the covariance changes by less than this share.
const SETTLED: f64 = 1e-12;

pub(crate) type Square = [[f64; STATES]; STATES];

/// The gains for each slope, and the limits between the slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gains {
    /// The gains `of[k]` apply to slopes below `ends[k]` and not below `ends[k - 1]`; the last gains have no upper
    /// limit.
    pub(crate) ends: [f64; SLOPES - 1],
    /// Gains as change of the state per unit of signal, for target, rate and relaxations.
    pub(crate) of: [[f64; STATES]; SLOPES],
}

impl Gains {
    /// Computes the gains of `map` at `period_s`, for the slopes of its curve times `sign`, in signal per drive.
    ///
    /// # Errors
    /// A curve whose direction contradicts the polarity, because it would be inverted in the wrong direction.
    pub(crate) fn new(map: &ObserverMap, sign: f64, period_s: f64) -> Result<Self, DesignError> {
        let Interval { min, max } = map.drive_domain;
        let step = (max - min) / (map.curve.len() - 1) as f64;
        let slopes = map.curve.windows(2).map(|pair| sign * (pair[1] - pair[0]) / step);
        let (flattest, steepest) =
            slopes.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), s| (a.min(s), b.max(s)));
        DesignError::check("rise of observer.curve", flattest, flattest > 0.0)?;
        let ratio = libm::pow(steepest / flattest, 1.0 / (SLOPES - 1) as f64);
        let mut gains = Self { ends: [0.0; SLOPES - 1], of: [[0.0; STATES]; SLOPES] };
        let mut slope = flattest;
        for k in 0..SLOPES {
            gains.of[k] = settled(map, period_s, slope);
            for gain in gains.of[k] {
                DesignError::check("gain of observer", gain, true)?;
            }
            if k + 1 < SLOPES {
                gains.ends[k] = slope * libm::sqrt(ratio);
            }
            slope *= ratio;
        }
        Ok(gains)
    }
}

/// Returns the stationary Kalman gain for one slope of the curve.
///
/// Source: structure-preserving doubling, Chu et al. 2004,
/// doi:10.1080/00207170410001714988.
fn settled(map: &ObserverMap, period_s: f64, slope: f64) -> [f64; STATES] {
    let (mut a, mut g, mut p) = (identity(), [[0.0; STATES]; STATES], [[0.0; STATES]; STATES]);
    let mut gradient = [0.0; STATES];
    (gradient[0], gradient[1]) = (1.0, map.lead_s);
    for (i, (&tau, &amplitude)) in map.relaxations_s.iter().zip(map.amplitudes.iter()).enumerate() {
        let share = lag_share(period_s, tau);
        (gradient[0], gradient[2 + i]) = (gradient[0] + amplitude, -amplitude);
        // the transition, transposed; a relaxation follows the predicted target
        (a[0][2 + i], a[1][2 + i], a[2 + i][2 + i]) = (share, share * period_s, 1.0 - share);
    }
    a[1][0] = period_s;
    // the transition of an unused state is set to zero; otherwise the state would keep its variance
    for unused in 2 + map.relaxations_s.len()..STATES {
        a[unused][unused] = 0.0;
    }
    let noise = map.noise * map.noise;
    for i in 0..STATES {
        for j in 0..STATES {
            g[i][j] = slope * slope * gradient[i] * gradient[j] / noise;
        }
    }
    p[1][1] = map.agility * period_s;
    for _ in 0..DOUBLINGS {
        let Some(inverse) = inverse(&plus(&identity(), &times(&g, &p))) else { break };
        let half = times(&a, &inverse);
        let more = times(&times(&transposed(&a), &p), &times(&inverse, &a));
        g = plus(&g, &times(&half, &times(&g, &transposed(&a))));
        a = times(&half, &a);
        p = plus(&p, &more);
        if more[0][0].abs() <= SETTLED * p[0][0] {
            break;
        }
    }
    let mut reach = [0.0; STATES];
    let mut spread = noise;
    for i in 0..STATES {
        reach[i] = slope * (0..STATES).map(|j| p[i][j] * gradient[j]).sum::<f64>();
        spread += slope * reach[i] * gradient[i];
    }
    reach.map(|r| r / spread)
}

fn identity() -> Square {
    let mut out = [[0.0; STATES]; STATES];
    for i in 0..STATES {
        out[i][i] = 1.0;
    }
    out
}

fn transposed(x: &Square) -> Square {
    let mut out = *x;
    for i in 0..STATES {
        for j in 0..STATES {
            out[i][j] = x[j][i];
        }
    }
    out
}

fn plus(x: &Square, y: &Square) -> Square {
    let mut out = *x;
    for (row, other) in out.iter_mut().zip(y) {
        row.iter_mut().zip(other).for_each(|(a, b)| *a += b);
    }
    out
}

fn times(x: &Square, y: &Square) -> Square {
    let mut out = [[0.0; STATES]; STATES];
    for i in 0..STATES {
        for j in 0..STATES {
            out[i][j] = (0..STATES).map(|k| x[i][k] * y[k][j]).sum();
        }
    }
    out
}

/// The inverse by Gauss-Jordan elimination with row exchanges; `None` for a singular matrix.
fn inverse(x: &Square) -> Option<Square> {
    let (mut left, mut right) = (*x, identity());
    for i in 0..STATES {
        let size = |row: &usize| left[*row][i].abs();
        let pivot = (i..STATES).max_by(|a, b| size(a).total_cmp(&size(b)))?;
        left.swap(i, pivot);
        right.swap(i, pivot);
        let scale = left[i][i];
        if !(scale.abs() > 0.0 && scale.is_finite()) {
            return None;
        }
        for j in 0..STATES {
            left[i][j] /= scale;
            right[i][j] /= scale;
        }
        for row in (0..STATES).filter(|&row| row != i) {
            let share = left[row][i];
            for j in 0..STATES {
                left[row][j] -= share * left[i][j];
                right[row][j] -= share * right[i][j];
            }
        }
    }
    Some(right)
}
