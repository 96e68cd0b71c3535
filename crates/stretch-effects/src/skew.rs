//! Samples that show a signal of some time earlier or later.

use crate::{
    grid::Grid,
    operator::{Operator, Span},
};

/// By how much samples are late.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SkewSpec {
    /// At the trial's start, s.
    pub skew_s: f64,
    /// How much later they get, s/s: two clocks that part.
    pub rate: f64,
}

/// Reads a signal `skew_s + rate t` before every sample, t since the trial began, by cubics through four nodes (Lagrange);
/// the first and the last value are held beyond the ends, and beside an end the cubic becomes a line.
///
/// ```
/// use stretch_effects::{Grid, Skew, SkewSpec};
/// let line: Vec<f64> = (0..100).map(f64::from).collect();
/// let mut shown = vec![0.0; 100];
/// Skew::new(&Grid::samples(0.01)?, SkewSpec { skew_s: 0.025, rate: 0.0 }).sample(&line, &mut shown);
/// assert!((shown[50] - 47.5).abs() < 1e-9 && shown[0] == 0.0);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Skew {
    grid: Grid,
    spec: SkewSpec,
    at_start: Reading,
}

/// How one sample is read from the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reading {
    /// Node before the moment, relative to the sample's own.
    offset: isize,
    /// Weights of that node's predecessor, the node, and the two after it.
    weights: [f64; 4],
    /// Share of the way from the node to the next.
    share: f64,
}

impl Skew {
    /// Of samples of a grid.
    pub fn new(grid: &Grid, spec: SkewSpec) -> Self {
        Self { grid: grid.clone(), spec, at_start: Reading::new(grid, spec.skew_s) }
    }

    /// Fills the samples from a value at every node.
    pub fn sample(&self, nodes: &[f64], samples: &mut [f64]) {
        let pieces = self.grid.pieces();
        if nodes.is_empty() {
            return;
        }
        if self.spec.rate == 0.0 {
            for (i, out) in samples.iter_mut().enumerate() {
                *out = self.at_start.of(nodes, i * pieces);
            }
            return;
        }
        for (i, out) in samples.iter_mut().enumerate() {
            let late_s = self.spec.skew_s + self.spec.rate * (i as f64 * self.grid.dt_s());
            *out = Reading::new(&self.grid, late_s).of(nodes, i * pieces);
        }
    }
}

/// On samples of a whole trial.
impl Operator for Skew {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        let nodes = signal.to_vec();
        self.sample(&nodes, signal);
    }
}

impl Reading {
    fn new(grid: &Grid, skew_s: f64) -> Self {
        let pieces = grid.pieces();
        let samples = libm::floor(-skew_s / grid.dt_s());
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
        let weights = core::array::from_fn(|i| {
            (0..4).filter(|j| *j != i).map(|j| (t - nodes[j]) / (nodes[i] - nodes[j])).product()
        });
        // The cast saturates: a skew longer than any trial holds an end throughout.
        let offset =
            (samples as isize).saturating_mul(pieces as isize).saturating_add(piece as isize);
        Self { offset, weights, share }
    }

    /// The value that the sample at a node shows.
    #[inline]
    fn of(&self, nodes: &[f64], own: usize) -> f64 {
        let last = nodes.len() as isize - 1;
        let node = (own as isize).saturating_add(self.offset);
        if node >= 1 && node + 2 <= last {
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
        }
    }
}
