//! Standard errors of an observer's dynamics.

use crate::{
    observer_curve::{CurveRows, KNOTS},
    observer_model::{Forward, Piece, SETTLE},
};

/// Time over which errors of the model are taken to be correlated, s: that of the slowest relevant part of the model,
/// not a few samples.
const BLOCK_S: f64 = 2.0;
/// Relative step of a time constant for the derivative of the drive.
const NUDGE: f64 = 0.01;
/// Ridge that avoids a division by zero for a parameter that no data determine, as a share of its column's power. The
/// share is far below that of any data that determine the parameter.
const RIDGE: f64 = 1e-9;

/// Standard errors and condition of a forward model.
pub(crate) struct Bounds {
    /// Standard errors of lead, amplitudes and weights of plays, then of the time
    /// constants; NaN where the data do not determine them.
    pub(crate) errors: Vec<f64>,
    /// Condition number of the rows behind the standard errors.
    pub(crate) condition: f64,
}

/// Bounds of a forward model on the pieces that it was fitted to.
///
/// The bounds are sandwich estimates over blocks of two seconds, for the curve, the dynamics and the time constants
/// together: an effect that the curve or a time constant could absorb is
/// not counted as known. The choice of the structure is taken as known.
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
