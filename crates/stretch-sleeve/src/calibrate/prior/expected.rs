//! Errors of a prior on left-out sessions, after different durations of reference.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::calibrate::linear::inverse;

use super::{
    session::PARTS_S,
    tree::{Leaf, Normal},
};

/// Smallest number of independent samples, one per second, in a part on which errors are judged.
const LEAST_COUNT: f64 = 5.0;

/// Errors after some seconds of reference on sessions that were left out of the prior. Each session is judged on the
/// samples after its first minute. A shorter session is judged on its samples after 30, 20 or 10 s, for durations of
/// reference up to that time. An error is `None` if no session can be judged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Seconds of reference.
    pub seconds: f64,
    /// Root mean square error if the prior knows sessions of the same sensor and wearer, in the reference's unit.
    pub rmse_known: Option<f64>,
    /// Root mean square error if the prior does not know the first step of the path (the sensor or wearer).
    pub rmse_new: Option<f64>,
    /// Half of the interval that contains 95 % of the errors in `rmse_known`, in the same unit.
    pub half_width_95_known: Option<f64>,
    /// Half of the interval that contains 95 % of the errors in `rmse_new`.
    pub half_width_95_new: Option<f64>,
}

/// Returns half of the interval that contains 95 % of the errors of sessions with these mean squared errors `r`: the
/// width at which the mean of `erf(width/sqrt(2 r))` over the sessions is 0.95. Errors within a session are assumed to
/// be normal.
fn half_width_95(squares: &[f64]) -> Option<f64> {
    let count = squares.len() as f64;
    let inside = |width: f64| {
        let one = |r: &f64| libm::erf(width / (2.0 * r.max(f64::MIN_POSITIVE)).sqrt());
        squares.iter().map(one).sum::<f64>() / count
    };
    // The half-width for the worst session alone is an upper bound.
    let worst = squares.iter().copied().reduce(f64::max)?.sqrt() * 1.96;
    let (mut low, mut high) = (0.0, worst);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if inside(middle) < 0.95 { low = middle } else { high = middle }
    }
    Some(high)
}

/// Returns the table of errors. For each session, `left` holds the priors that were learnt without it. `unit` is the
/// size of one unit of the normalised target in the reference's unit.
pub(crate) fn expected(
    parts: &[Vec<Leaf>],
    left: &[[Option<Normal>; 2]],
    noise: f64,
    unit: f64,
) -> Vec<Expected> {
    let seconds = [0.0].into_iter().chain(PARTS_S);
    let one = |(used, seconds): (usize, f64)| {
        let [known, new] = [0, 1].map(|which| left_out_squares(parts, left, which, used, noise));
        let rmse = |squares: &[f64]| {
            let mean = squares.iter().sum::<f64>() / squares.len() as f64;
            (!squares.is_empty()).then(|| mean.sqrt() * unit)
        };
        let half_width = |squares: &[f64]| half_width_95(squares).map(|width| width * unit);
        Expected {
            seconds,
            rmse_known: rmse(&known),
            rmse_new: rmse(&new),
            half_width_95_known: half_width(&known),
            half_width_95_new: half_width(&new),
        }
    };
    seconds.enumerate().map(one).collect()
}

/// Returns the mean squared error of each left-out session after its first `used` parts.
fn left_out_squares(
    parts: &[Vec<Leaf>],
    left: &[[Option<Normal>; 2]],
    which: usize,
    used: usize,
    noise: f64,
) -> Vec<f64> {
    let one = |(parts, left): (&Vec<Leaf>, &[Option<Normal>; 2])| {
        // A short session is judged on its last part that is long enough. It is skipped if the reference extends into
        // this part.
        let judged = parts.iter().rposition(|part| part.count >= LEAST_COUNT);
        let rest = &parts[judged.filter(|at| *at >= used)?];
        let seen = parts[..used]
            .iter()
            .try_fold(left[which].clone()?, |normal, part| after(&normal, part, noise));
        Some(rest.squares_at(&seen?.mean) / rest.count)
    };
    parts.iter().zip(left).filter_map(one).collect()
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
    fn the_interval_holds_95_percent_of_the_errors_of_equal_and_of_unequal_sessions() {
        let equal = half_width_95(&[0.25; 7]).unwrap();
        assert!((equal - 0.98).abs() < 1e-3, "{equal}");
        let unequal = half_width_95(&[0.1, 0.1, 0.1, 1.7]).unwrap();
        let inside = |r: f64| libm::erf(unequal / (2.0 * r).sqrt());
        assert!(((3.0 * inside(0.1) + inside(1.7)) / 4.0 - 0.95).abs() < 1e-9);
        assert_eq!(half_width_95(&[]), None);
    }
}
