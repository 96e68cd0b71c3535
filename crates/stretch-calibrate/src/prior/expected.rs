//! What a prior errs by on sessions that were left out, by seconds of reference.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use crate::positive::inverse;

use super::{
    session::PARTS_S,
    tree::{Leaf, Normal},
};

/// Fewest samples that count, each a second, of a part that errors are judged on.
const LEAST_COUNT: f64 = 5.0;

/// The error on sessions left out, after some seconds of reference. Each is judged on what comes after its first
/// minute; one that is shorter, on its end (what comes after 30, 20 or 10 s), for the seconds before that.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// Seconds of reference.
    pub seconds: f64,
    /// Root mean square error where sessions of the same sensor and wearer were seen, in the reference's unit.
    pub rmse_known: Option<f64>,
    /// Root mean square error where the topmost of sensor and wearer was not seen.
    pub rmse_new: Option<f64>,
    /// Mean squared error over the variance that the model predicts, as `rmse_known`.
    pub widening_known: f64,
    /// Mean squared error over the variance that the model predicts, as `rmse_new`.
    pub widening_new: f64,
}

/// The table of a prior. `left` holds the prior of each session without it; `unit` is what a normalised target is in
/// the reference's unit.
pub(crate) fn expected(
    parts: &[Vec<Leaf>],
    left: &[[Option<Normal>; 2]],
    noise: f64,
    unit: f64,
) -> Vec<Expected> {
    let seconds = [0.0].into_iter().chain(PARTS_S);
    let one = |(used, seconds): (usize, f64)| {
        let judge = |which: usize| judged(parts, left, which, used, noise);
        let (known, new) = (judge(0), judge(1));
        Expected {
            seconds,
            rmse_known: known.map(|(squares, _)| squares.sqrt() * unit),
            rmse_new: new.map(|(squares, _)| squares.sqrt() * unit),
            widening_known: known.map_or(1.0, |(_, ratio)| ratio.max(1.0)),
            widening_new: new.map_or(1.0, |(_, ratio)| ratio.max(1.0)),
        }
    };
    seconds.enumerate().map(one).collect()
}

/// Mean squared error, and its mean ratio to the predicted variance, after the first `used` parts.
fn judged(
    parts: &[Vec<Leaf>],
    left: &[[Option<Normal>; 2]],
    which: usize,
    used: usize,
    noise: f64,
) -> Option<(f64, f64)> {
    let (mut squares, mut ratio, mut count) = (0.0, 0.0, 0.0);
    for (parts, left) in parts.iter().zip(left) {
        // a short session is judged on its end, for as many seconds as lie before it
        let judged = parts.iter().rposition(|part| part.count >= LEAST_COUNT);
        let (Some(prior), Some(at)) = (&left[which], judged.filter(|at| *at >= used)) else {
            continue;
        };
        let rest = &parts[at];
        let posterior = parts[..used]
            .iter()
            .try_fold(prior.clone(), |normal, part| after(&normal, part, noise))?;
        let error = rest.squares_at(&posterior.mean) / rest.count;
        squares += error;
        ratio += error / (rest.variance(&posterior) / rest.count + noise);
        count += 1.0;
    }
    (count > 0.0).then(|| (squares / count, ratio / count))
}

/// A distribution after the rows of a part.
fn after(normal: &Normal, part: &Leaf, noise: f64) -> Option<Normal> {
    let precision = inverse(&normal.covariance)?;
    let covariance = inverse(&(&precision + &part.gram / noise))?;
    let pull: DVector<f64> = &precision * &normal.mean + &part.cross / noise;
    Some(Normal { mean: &covariance * pull, covariance })
}
