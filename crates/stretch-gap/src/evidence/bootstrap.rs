//! Closed-gap fraction with an interval, by block bootstrap.
//!
//! Residuals are correlated within blocks, which are drawn whole and with replacement (Kunsch 1989, doi 10.1214/aos/1176347265);
//! the interval is that of the percentiles of the draws.

use crate::{
    fit::score::{gap, mean_square},
    numerics::random::Dice,
};

/// Draws of the bootstrap.
const DRAWS: usize = 400;

/// Closed-gap fraction on the test blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Closed {
    pub(crate) before: f64,
    pub(crate) after: f64,
    pub(crate) closed: f64,
    pub(crate) interval: [f64; 2],
    /// Whether the mean square falls for certain, at the same level.
    pub(crate) falls: bool,
}

/// CGF = 1 - sum max(0, excess after)/sum max(0, excess before), channels in step: a block is drawn for all of them.
pub(crate) fn closed_interval(before: &[Vec<f64>], after: &[Vec<f64>], seed: u64) -> Closed {
    let whole = |blocks: &[Vec<f64>]| -> f64 { blocks.iter().map(|b| gap(mean_square(b))).sum() };
    let closed = |before: f64, after: f64| {
        if before > 1e-9 { 1.0 - after / before } else { 0.0 }
    };
    let (b, a) = (whole(before), whole(after));
    let count = before.first().map_or(0, Vec::len);
    let (mut draws, mut falls) = (Vec::with_capacity(DRAWS), Vec::with_capacity(DRAWS));
    let mut dice = Dice::new(seed, 77);
    for _ in 0..DRAWS {
        let mut sums = vec![(0.0, 0.0); before.len()];
        for _ in 0..count {
            let block = dice.below(count);
            for (sum, (x, y)) in sums.iter_mut().zip(before.iter().zip(after)) {
                sum.0 += x[block];
                sum.1 += y[block];
            }
        }
        let n = count.max(1) as f64;
        let one = |sum: f64| gap(sum / n);
        let drawn = closed(
            sums.iter().map(|s| one(s.0)).sum::<f64>(),
            sums.iter().map(|s| one(s.1)).sum::<f64>(),
        );
        draws.push(drawn);
        falls.push(sums.iter().map(|s| s.0 - s.1).sum::<f64>());
    }
    draws.sort_by(f64::total_cmp);
    falls.sort_by(f64::total_cmp);
    let at = |q: f64| ((q * DRAWS as f64) as usize).min(DRAWS - 1);
    let interval = [draws[at(0.025)], draws[at(0.975)]];
    Closed { before: b, after: a, closed: closed(b, a), interval, falls: falls[at(0.025)] > 0.0 }
}
