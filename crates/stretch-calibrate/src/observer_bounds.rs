//! How well the data determine an observer's dynamics.

use crate::{
    dense::{Sums, block_errors},
    observer_fit::{BEND, Forward, KNOTS, Piece, SETTLE, driven, features, place},
};

/// Errors of the model are correlated over as long as the slowest of its parts
/// that matter, not over a few samples.
const BLOCK_S: f64 = 2.0;
/// A time constant is moved by this share to see what it does.
const NUDGE: f64 = 0.01;

/// Standard errors of lead, amplitudes and weights of plays, then of the time constants.
///
/// The sandwich over blocks of two seconds, of the curve, the dynamics and the time
/// constants together: what the curve or a time constant could take up instead is
/// not counted as known. The choice of the structure is.
pub(crate) fn bounds(pieces: &[Piece], forward: &Forward, period_s: f64) -> Vec<f64> {
    let Forward { choice, curve, drive, dynamics, .. } = forward;
    let taus: Vec<f64> = choice.taus().collect();
    let first = KNOTS + dynamics.len();
    let size = first + taus.len();
    let mut sums = Sums::new(size);
    let mut blocks: Vec<Vec<f64>> = Vec::new();
    let length = ((BLOCK_S / period_s) as usize).max(1);
    let per_knot = (KNOTS - 1) as f64 / (drive.max - drive.min);
    for piece in pieces {
        let rows = features(piece, *choice, period_s);
        let nudged: Vec<_> = (0..taus.len())
            .map(|i| {
                let mut other = *choice;
                other.taus[i] = other.taus[i].map(|tau| tau * (1.0 + NUDGE));
                features(piece, other, period_s)
            })
            .collect();
        for (n, row) in rows.iter().enumerate().skip(SETTLE) {
            let at = driven(&(piece.smooth[n], row, piece.signal[n]), dynamics);
            let (below, share) = place(at, *drive);
            let rise = curve[below + 1] - curve[below];
            let residual = piece.signal[n] - curve[below] - share * rise;
            let slope = rise * per_knot;
            let mut places = vec![below, below + 1];
            let mut values = vec![1.0 - share, share];
            places.extend(KNOTS..size);
            values.extend(row.iter().map(|f| slope * f));
            values.extend((0..taus.len()).map(|i| {
                let change = (nudged[i][n][1 + i] - row[1 + i]) / (NUDGE * taus[i]);
                slope * dynamics[1 + i] * change
            }));
            sums.push_sparse(&places, &values, residual);
            if (n - SETTLE).is_multiple_of(length) {
                blocks.push(vec![0.0; size]);
            }
            if let Some(block) = blocks.last_mut() {
                for (&place, x) in places.iter().zip(&values) {
                    block[place] += residual * x;
                }
            }
        }
    }
    let bend = (BEND * sums.samples).sqrt();
    for k in 1..KNOTS - 1 {
        sums.push_sparse(&[k - 1, k, k + 1], &[bend, -2.0 * bend, bend], 0.0);
    }
    match sums.triangle(|_, diagonal| 1e-9 * diagonal + 1e-300) {
        Some(triangle) => block_errors(&triangle, &blocks).split_off(KNOTS),
        None => vec![f64::NAN; size - KNOTS],
    }
}
