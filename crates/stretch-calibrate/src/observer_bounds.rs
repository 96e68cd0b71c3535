//! How well the data determine an observer's dynamics.

use crate::{
    observer_curve::{CurveRows, KNOTS},
    observer_model::{Forward, Piece, SETTLE},
};

/// Errors of the model are correlated over as long as the slowest of its parts
/// that matter, not over a few samples.
const BLOCK_S: f64 = 2.0;
/// A time constant is moved by this share to see what it does.
const NUDGE: f64 = 0.01;
/// Keeps a parameter that nothing shows from being divided by: as a share of its
/// column's power, far below what any data that determine it have.
const RIDGE: f64 = 1e-9;

/// How well a forward model is determined.
pub(crate) struct Bounds {
    /// Standard errors of lead, amplitudes and weights of plays, then of the time
    /// constants; NaN where the data do not determine them.
    pub(crate) errors: Vec<f64>,
    /// Condition of the rows that they come from.
    pub(crate) condition: f64,
}

/// Bounds of a forward model on the pieces that it was fitted to.
///
/// The sandwich over blocks of two seconds, of the curve, the dynamics and the time
/// constants together: what the curve or a time constant could take up instead is
/// not counted as known. The choice of the structure is.
pub(crate) fn bounds(pieces: &[Piece], forward: &Forward, period_s: f64) -> Bounds {
    let Forward { choice, curve, drive, dynamics, .. } = forward;
    let taus: Vec<f64> = choice.taus().collect();
    let more = dynamics.len() + taus.len();
    let mut rows = CurveRows::new(more);
    let mut blocks: Vec<Vec<f64>> = Vec::new();
    let length = ((BLOCK_S / period_s) as usize).max(1);
    let mut values = Vec::new();
    for piece in pieces {
        let features = piece.features(*choice, period_s);
        let nudged: Vec<_> = (0..taus.len())
            .map(|i| {
                let mut other = *choice;
                other.taus[i] = other.taus[i].map(|tau| tau * (1.0 + NUDGE));
                piece.features(other, period_s)
            })
            .collect();
        for (n, sample) in piece.samples(&features).enumerate() {
            let at = forward.place(&sample);
            let slope = at.slope(curve, *drive);
            let residual = sample.signal - at.on(curve);
            values.clear();
            values.extend(sample.features.iter().map(|f| slope * f));
            values.extend((0..taus.len()).map(|i| {
                let moved = nudged[i][SETTLE + n][1 + i] - sample.features[1 + i];
                slope * dynamics[1 + i] * moved / (NUDGE * taus[i])
            }));
            rows.push(at, &values, residual);
            if n.is_multiple_of(length) {
                blocks.push(vec![0.0; KNOTS + more]);
            }
            if let Some(block) = blocks.last_mut() {
                block[at.below] += residual * (1.0 - at.share);
                block[at.below + 1] += residual * at.share;
                for (sum, x) in block[KNOTS..].iter_mut().zip(&values) {
                    *sum += residual * x;
                }
            }
        }
    }
    // the least positive number keeps a column of zeros from dividing by nothing
    match rows.factor().solve(|_, power| RIDGE * power + 1e-300) {
        Some(solution) => Bounds {
            errors: solution.block_errors(&blocks).split_off(KNOTS),
            condition: solution.condition(),
        },
        None => Bounds { errors: vec![f64::NAN; more], condition: f64::INFINITY },
    }
}
