//! Samples that show a signal of some time earlier or later.

use crate::grid::Grid;

/// Reads a signal at nodes `skew_s` before every sample, by cubics through four nodes; the first and the last
/// value are held beyond the ends, and beside an end the cubic becomes a line.
#[derive(Debug, Clone)]
pub(crate) struct Skew {
    pieces: usize,
    /// Node before the moment, relative to the sample's own.
    offset: isize,
    /// Weights of that node's predecessor, the node, and the two after it.
    weights: [f64; 4],
    /// Share of the way from the node to the next.
    share: f64,
}

impl Skew {
    pub(crate) fn new(grid: &Grid, skew_s: f64) -> Self {
        let pieces = grid.pieces();
        let samples = (-skew_s / grid.dt_s()).floor();
        // Time after that sample, within one sample.
        let mut after = (-skew_s - samples * grid.dt_s()).clamp(0.0, grid.dt_s());
        let mut piece = 0;
        while piece + 1 < pieces && after >= grid.steps()[piece] {
            after -= grid.steps()[piece];
            piece += 1;
        }
        let step = |i: usize| grid.steps()[i % pieces];
        let here = step(piece);
        let share = (after / here).clamp(0.0, 1.0);
        let t = share * here;
        let nodes = [-step(piece + pieces - 1), 0.0, here, here + step(piece + 1)];
        let weights = std::array::from_fn(|i| {
            (0..4).filter(|j| *j != i).map(|j| (t - nodes[j]) / (nodes[i] - nodes[j])).product()
        });
        // The cast saturates: a skew longer than any trial holds an end throughout.
        let offset =
            (samples as isize).saturating_mul(pieces as isize).saturating_add(piece as isize);
        Self { pieces, offset, weights, share }
    }

    pub(crate) fn sample(&self, nodes: &[f64], samples: &mut [f64]) {
        let last = nodes.len() as isize - 1;
        for (i, out) in samples.iter_mut().enumerate() {
            let node = ((i * self.pieces) as isize).saturating_add(self.offset);
            *out = if node >= 1 && node + 2 <= last {
                let around = &nodes[node as usize - 1..node as usize + 3];
                let [a, b, c, d] = self.weights;
                a * around[0] + b * around[1] + (c * around[2] + d * around[3])
            } else if node < 0 {
                nodes[0]
            } else if node >= last {
                nodes[last as usize]
            } else {
                let [x, y] = [nodes[node as usize], nodes[node as usize + 1]];
                x + self.share * (y - x)
            };
        }
    }
}
