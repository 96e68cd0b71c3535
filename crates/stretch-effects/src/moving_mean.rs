//! The mean of a signal over the time before each sample.

use alloc::{vec, vec::Vec};

use crate::{
    grid::Grid,
    operator::{Operator, Span},
};

/// The moving mean y(t) = (1/T) integral of x from t - T to t, for a signal that is linear between nodes. It is exact
/// at every node, and a constant signal is unchanged to the last bit. If the input is a trapezoid profile, makers of
/// drives call the mean an S-curve or jerk filter (Biagiotti and Melchiorri, doi 10.1016/j.conengprac.2012.08.005). The
/// memory is the input at the nodes of the last time T.
///
/// ```
/// use stretch_effects::{Grid, MovingMean, Operator, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let mean = MovingMean::new(&grid, 0.025);
/// let (mut cells, mut signal) = (vec![0.0; mean.cells()], [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
/// mean.begin(Start::Settled, 0.0, &mut cells);
/// mean.run(&Span::whole(&grid), &mut cells, &mut signal);
/// // A ramp is late by half of the time.
/// assert!((signal[5] - 3.75).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MovingMean {
    /// For each interval of the grid: weights of the nodes before the node at its end, the latest first. The node at
    /// the end has the weight 1 minus their sum.
    weights: Vec<Vec<f64>>,
    reach: usize,
}

impl MovingMean {
    /// A mean over `window_s`. A window of 0 changes nothing. A window of more than a hundred thousand nodes is cut to
    /// that number.
    pub fn new(grid: &Grid, window_s: f64) -> Self {
        let weights: Vec<Vec<f64>> =
            (0..grid.pieces()).map(|piece| weights(grid.steps(), piece, window_s)).collect();
        let reach = weights.iter().map(Vec::len).max().unwrap_or(0);
        Self { weights, reach }
    }
}

/// Greatest number of nodes that a mean remembers, so that a very long window costs a limited time.
const MOST_NODES: usize = 100_000;

/// Returns the weights of the nodes before the present one, the latest first. `piece` is the index in `steps` of the
/// interval that ends at the present node. Within each interval the signal is a straight line, which is integrated
/// exactly.
fn weights(steps: &[f64], piece: usize, window_s: f64) -> Vec<f64> {
    let (mut found, mut left, mut at, mut whole) = (Vec::new(), window_s, piece, 0.0);
    while left > 0.0 && found.len() < MOST_NODES {
        let h = steps[at];
        let taken = h.min(left);
        // For the line back to the preceding node: the integrals of 1 - s/h and s/h over the part inside the window.
        let earlier = 0.5 * taken * taken / h;
        if let Some(last) = found.last_mut() {
            *last += taken - earlier;
        }
        found.push(earlier);
        left -= taken;
        whole += taken;
        at = if at == 0 { steps.len() - 1 } else { at - 1 };
    }
    found.iter_mut().for_each(|w| *w /= whole);
    found
}

impl Operator for MovingMean {
    fn cells(&self) -> usize {
        self.reach
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        // The remembered values, the earliest first, followed by the signal.
        let mut all = vec![0.0; self.reach + signal.len()];
        all[..self.reach].copy_from_slice(cells);
        all[self.reach..].copy_from_slice(signal);
        let pieces = self.weights.len();
        for (i, y) in signal.iter_mut().enumerate() {
            let weights = &self.weights[(span.first_node + i + pieces - 1) % pieces];
            let now = *y;
            let before = all[..self.reach + i].iter().rev();
            *y += weights.iter().zip(before).map(|(w, x)| w * (x - now)).sum::<f64>();
        }
        cells.copy_from_slice(&all[signal.len()..]);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Start;

    /// Rounding of some hundred products of values up to 10.
    const ROUNDING: f64 = 1e-12;

    fn mean(grid: &Grid, window_s: f64, signal: &[f64], parts: usize) -> Vec<f64> {
        let mean = MovingMean::new(grid, window_s);
        let (mut cells, mut out) = (vec![0.0; mean.cells()], signal.to_vec());
        mean.begin(Start::Settled, signal[0], &mut cells);
        let mut first_node = 0;
        for part in out.chunks_mut(parts) {
            let count = part.len();
            mean.run(&Span { first_node, ..Span::whole(grid) }, &mut cells, part);
            first_node += count;
        }
        out
    }

    #[test]
    fn a_time_without_end_is_a_mean_over_what_is_remembered() {
        let grid = Grid::samples(0.01).unwrap();
        for window_s in [f64::INFINITY, f64::MAX, f64::NAN, -1.0] {
            let out = mean(&grid, window_s, &[0.0, 1.0, 2.0], 3);
            let is_kept = if window_s > 0.0 { out[2] < 0.001 } else { out == [0.0, 1.0, 2.0] };
            assert!(is_kept, "{window_s}: {out:?}");
        }
    }

    proptest! {
        /// A linear signal is delayed by half of the window on any grid, once the window is full.
        #[test]
        fn a_line_is_half_a_window_late(window_s in 1e-4..0.05_f64, delay_s in 0.0..0.03_f64, slope in -9.0..9.0_f64) {
            let grid = Grid::new(0.01, 0.004, delay_s).unwrap();
            let line: Vec<f64> = (0..60).map(|node| slope * grid.time_s(node)).collect();
            for (node, y) in mean(&grid, window_s, &line, 60).iter().enumerate() {
                let t = grid.time_s(node);
                if t > window_s {
                    prop_assert!((y - slope * (t - 0.5 * window_s)).abs() < ROUNDING, "{y} at {t}");
                }
            }
        }

        /// Blocks give the same output as the whole signal, a constant is unchanged, and the output stays in the range
        /// of the input.
        #[test]
        fn parts_give_the_whole(
            signal in proptest::collection::vec(-10.0..10.0_f64, 1..80), window_s in 0.0..0.3_f64, parts in 1..80_usize
        ) {
            let grid = Grid::new(0.01, 0.006, 0.0).unwrap();
            let whole = mean(&grid, window_s, &signal, signal.len());
            prop_assert_eq!(&whole, &mean(&grid, window_s, &signal, parts));
            let [low, high] = [f64::min, f64::max].map(|f| signal.iter().copied().fold(signal[0], f));
            prop_assert!(whole.iter().all(|y| (low - ROUNDING..=high + ROUNDING).contains(y)));
            let flat = vec![signal[0]; 30];
            prop_assert_eq!(mean(&grid, window_s, &flat, 30), flat);
        }
    }
}
