//! Errors of a prior on left-out sessions, after different durations of reference.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::calibrate::linear::inverse;

use super::{
    session::PARTS_S,
    tree::{Leaf, Normal},
};

/// Smallest number of independent samples, one per second, in a part on which errors are judged.
const LEAST_COUNT: f64 = 5.0;

/// Expected error after some seconds of reference, measured on left-out sessions. Each session is judged on the samples
/// after its first minute. A shorter session is judged on its end (after 30, 20 or 10 s), for durations up to the
/// beginning of that end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Seconds of reference.
    pub seconds: f64,
    /// Root mean square error if the prior knows sessions of the same sensor and wearer, in the reference's unit.
    pub rmse_known: Option<f64>,
    /// Root mean square error if the prior does not know the first step of the path (the sensor or wearer).
    pub rmse_new: Option<f64>,
    /// Spread of errors for `rmse_known`.
    pub spread_known: ErrorSpread,
    /// Spread of errors for `rmse_new`.
    pub spread_new: ErrorSpread,
}

/// Spread of errors on left-out sessions, relative to the model's prediction.
///
/// Each session has a ratio `r` of the mean squared error to the predicted variance. Errors within a session are
/// assumed to be normal. The 95 % interval of single estimates has a half-width of `c` predicted standard deviations,
/// where the mean of `erf(c/sqrt(2 r))` over the sessions is 0.95.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ErrorSpread {
    /// Mean ratio of the mean squared error to the predicted variance.
    pub widening: f64,
    /// Half of the 95 % interval, in predicted standard deviations.
    pub multiple_95: f64,
}

impl ErrorSpread {
    /// Values if there are no left-out sessions: errors are as predicted, and normal.
    pub const NORMAL: Self = Self { widening: 1.0, multiple_95: 1.96 };

    /// Returns the spread for sessions with these ratios.
    fn of(ratios: &[f64]) -> Self {
        if ratios.is_empty() {
            return Self::NORMAL;
        }
        let mean = |f: &dyn Fn(f64) -> f64| {
            ratios.iter().map(|r| f(r.max(f64::MIN_POSITIVE))).sum::<f64>() / ratios.len() as f64
        };
        let inside = |c: f64| mean(&|r| libm::erf(c / (2.0 * r).sqrt()));
        // The worst session alone gives an upper bound.
        let worst = ratios.iter().copied().fold(0.0, f64::max).sqrt() * 1.96;
        let (mut low, mut high) = (0.0, worst);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if inside(middle) < 0.95 { low = middle } else { high = middle }
        }
        Self { widening: mean(&|r| r), multiple_95: high }
    }
}

/// Returns `X'X/n` for a future session, from that of the prior and that of some seconds of the session. Each row of
/// `X` contains the terms of a sample. One minute of the session has the same weight as the prior.
pub(crate) fn mixed_gram(prior: &DMatrix<f64>, own: &DMatrix<f64>, seconds: f64) -> DMatrix<f64> {
    let weight = seconds / 60.0;
    (prior + own * weight) / (1.0 + weight)
}

/// Returns the table of expected errors. For each session, `left` holds the priors that were learnt without it. `gram`
/// is `X'X/n` of all sessions, and `unit` is the size of one unit of the normalised target in the reference's unit.
pub(crate) fn expected(
    parts: &[Vec<Leaf>],
    left: &[[Option<Normal>; 2]],
    (noise, gram): (f64, &DMatrix<f64>),
    unit: f64,
) -> Vec<Expected> {
    let seconds = [0.0].into_iter().chain(PARTS_S);
    let one = |(used, seconds): (usize, f64)| {
        let judge = |which: usize| judged(parts, left, which, used, (noise, gram));
        let (known, new) = (judge(0), judge(1));
        Expected {
            seconds,
            rmse_known: known.0.map(|squares| squares.sqrt() * unit),
            rmse_new: new.0.map(|squares| squares.sqrt() * unit),
            spread_known: ErrorSpread::of(&known.1),
            spread_new: ErrorSpread::of(&new.1),
        }
    };
    seconds.enumerate().map(one).collect()
}

/// Returns the mean squared error after the first `used` parts, and for each session its ratio to the predicted
/// variance.
fn judged(
    parts: &[Vec<Leaf>],
    left: &[[Option<Normal>; 2]],
    which: usize,
    used: usize,
    (noise, gram): (f64, &DMatrix<f64>),
) -> (Option<f64>, Vec<f64>) {
    let (mut squares, mut ratios) = (0.0, Vec::new());
    for (parts, left) in parts.iter().zip(left) {
        // A short session is judged on its end, after at most as many seconds as come before the end.
        let judged = parts.iter().rposition(|part| part.count >= LEAST_COUNT);
        let (Some(prior), Some(at)) = (&left[which], judged.filter(|at| *at >= used)) else {
            continue;
        };
        let rest = &parts[at];
        let seen = parts[..used]
            .iter()
            .try_fold(prior.clone(), |normal, part| after(&normal, part, noise));
        let Some(posterior) = seen else { continue };
        let error = rest.squares_at(&posterior.mean) / rest.count;
        squares += error;
        // The predicted variance is computed in the same way as in an update with these seconds of reference, because
        // an update multiplies its variance by the ratio.
        let count: f64 = parts[..used].iter().map(|part| part.count).sum();
        let sum = parts[..used].iter().fold(gram * 0.0, |sum, part| sum + &part.gram);
        let gram = mixed_gram(gram, &(sum / count.max(1.0)), count);
        ratios.push(error / (posterior.covariance.component_mul(&gram).sum() + noise));
    }
    let count = ratios.len() as f64;
    ((count > 0.0).then(|| squares / count), ratios)
}

/// Returns the distribution of the coefficients after an update with the rows of a part.
fn after(normal: &Normal, part: &Leaf, noise: f64) -> Option<Normal> {
    let precision = inverse(&normal.covariance)?;
    let covariance = inverse(&(&precision + &part.gram / noise))?;
    let pull: DVector<f64> = &precision * &normal.mean + &part.cross / noise;
    Some(Normal { mean: &covariance * pull, covariance })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_of_equal_sessions_is_normal_and_of_unequal_ones_holds_the_same_share() {
        let equal = ErrorSpread::of(&[0.25; 7]);
        assert!((equal.multiple_95 - 0.98).abs() < 1e-3 && equal.widening == 0.25, "{equal:?}");
        let unequal = ErrorSpread::of(&[0.1, 0.1, 0.1, 1.7]);
        let inside = |r: f64| libm::erf(unequal.multiple_95 / (2.0 * r).sqrt());
        assert!(((3.0 * inside(0.1) + inside(1.7)) / 4.0 - 0.95).abs() < 1e-9);
        assert!((unequal.widening - 0.5).abs() < 1e-12);
        assert_eq!(ErrorSpread::of(&[]), ErrorSpread::NORMAL);
    }
}
