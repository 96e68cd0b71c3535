//! Excess of slices, with intervals by block bootstrap, and the false-discovery correction.

use super::axes::Axis;
use crate::{fit::score::excess, numerics::random::Dice, problem::frame::Frame};

/// Share of false discoveries allowed among the slices that stand out.
const FALSE_DISCOVERIES: f64 = 0.05;
/// Draws of the bootstrap.
const DRAWS: usize = 200;
/// Blocks that a slice needs before it can stand out.
const LEAST_BLOCKS: usize = 6;

/// Sums of squares and counts by block and slice.
pub(super) struct Cells {
    slices: usize,
    /// By block, then by slice: sum of squares in floors, number of samples.
    cells: Vec<(f64, f64)>,
}

/// What is said of one slice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sliced {
    pub(super) share: f64,
    pub(super) excess: f64,
    pub(super) interval: [f64; 2],
    /// One-sided, against the rest of the stage.
    pub(super) p: f64,
}

impl Cells {
    pub(super) fn new(slices: usize, cells: Vec<(f64, f64)>) -> Self {
        Self { slices, cells }
    }

    pub(super) fn of_samples(frame: &Frame, residual: &[f64], axis: &Axis) -> Self {
        let slices = axis.labels.len();
        let mut cells = Vec::new();
        for segment in &frame.segments {
            let end = segment.to.min(residual.len()).min(axis.of.len());
            let mut from = segment.from.min(end);
            while from < end {
                let to = (from + frame.block).min(end);
                let base = cells.len();
                cells.resize(base + slices, (0.0, 0.0));
                for (r, slice) in residual[from..to].iter().zip(&axis.of[from..to]) {
                    if let Some(cell) = cells.get_mut(base + usize::from(*slice))
                        && usize::from(*slice) < slices
                    {
                        cell.0 += r * r;
                        cell.1 += 1.0;
                    }
                }
                from = to;
            }
        }
        Self { slices, cells }
    }

    pub(super) fn sliced(&self, seed: u64, stream: u64) -> Vec<Sliced> {
        if self.slices == 0 || self.cells.is_empty() {
            return Vec::new();
        }
        let blocks = self.cells.len() / self.slices;
        let all = vec![1_u32; blocks];
        let sums = self.sums(&all);
        let whole = sums.iter().fold((0.0, 0.0), |a, s| (a.0 + s.0, a.1 + s.1));
        let gaps: f64 = sums.iter().map(|s| (s.0 - s.1).max(0.0)).sum();
        let mut draws = vec![Vec::with_capacity(DRAWS); self.slices];
        let mut dice = Dice::new(seed, 900 + stream);
        for _ in 0..DRAWS {
            let mut times = vec![0_u32; blocks];
            (0..blocks).for_each(|_| times[dice.below(blocks)] += 1);
            for (slice, sum) in self.sums(&times).iter().enumerate() {
                if sum.1 > 0.0 {
                    draws[slice].push(excess(sum.0 / sum.1));
                }
            }
        }
        let one = |(slice, sum): (usize, &(f64, f64))| {
            let mut drawn = std::mem::take(&mut draws[slice]);
            if sum.1 <= 0.0 || drawn.is_empty() {
                return Sliced { share: 0.0, excess: 0.0, interval: [0.0; 2], p: 1.0 };
            }
            drawn.sort_by(f64::total_cmp);
            let at = |q: f64| drawn[((q * drawn.len() as f64) as usize).min(drawn.len() - 1)];
            Sliced {
                share: if gaps > 0.0 { (sum.0 - sum.1).max(0.0) / gaps } else { 0.0 },
                excess: excess(sum.0 / sum.1),
                interval: [at(0.025), at(0.975)],
                p: self.p_value(slice, *sum, whole),
            }
        };
        sums.iter().enumerate().map(one).collect()
    }

    fn sums(&self, times: &[u32]) -> Vec<(f64, f64)> {
        let mut sums = vec![(0.0, 0.0); self.slices];
        for (block, &times) in self.cells.chunks_exact(self.slices).zip(times) {
            if times > 0 {
                for (sum, cell) in sums.iter_mut().zip(block) {
                    sum.0 += f64::from(times) * cell.0;
                    sum.1 += f64::from(times) * cell.1;
                }
            }
        }
        sums
    }

    /// Probability that a slice like the rest is this much worse, by the linearised variance of a ratio of block sums.
    fn p_value(&self, slice: usize, own: (f64, f64), whole: (f64, f64)) -> f64 {
        let rest = (whole.0 - own.0, whole.1 - own.1);
        if rest.1 <= 0.0 {
            return 1.0;
        }
        let (mean, other) = (own.0 / own.1, rest.0 / rest.1);
        let (mut variance, mut seen) = (0.0, 0);
        for block in self.cells.chunks_exact(self.slices) {
            let cell = block[slice];
            let (square, count) = block.iter().fold((0.0, 0.0), |a, c| (a.0 + c.0, a.1 + c.1));
            let one = (cell.0 - mean * cell.1) / own.1;
            let two = (square - cell.0 - other * (count - cell.1)) / rest.1;
            variance += (one - two) * (one - two);
            seen += usize::from(cell.1 > 0.0);
        }
        if seen < LEAST_BLOCKS || variance <= 0.0 {
            return 1.0;
        }
        0.5 * libm::erfc((mean - other) / (2.0 * variance).sqrt())
    }
}

/// Which hypotheses fall at the level of false discoveries allowed.
pub(super) fn discoveries(p: &[f64]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let last = order
        .iter()
        .enumerate()
        .rev()
        .find(|(rank, i)| p[**i] <= FALSE_DISCOVERIES * (rank + 1) as f64 / p.len() as f64);
    let limit = last.map_or(f64::NEG_INFINITY, |(_, i)| p[*i]);
    p.iter().map(|p| *p <= limit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use testkit::tolerance::SLICE_EXCESS;

    #[test]
    fn benjamini_and_hochberg_as_in_their_paper() {
        // The fifteen p-values of their section 3.2: four rejections at 0.05.
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
            0.5719, 0.6528, 0.7590, 1.0,
        ];
        assert_eq!(discoveries(&p).iter().filter(|d| **d).count(), 4);
        assert!(discoveries(&[]).is_empty());
        assert_eq!(discoveries(&[0.2, 0.9]), [false, false]);
    }

    #[test]
    fn a_loud_slice_has_the_gap_and_stands_out() {
        let mut dice = Dice::new(5, 0);
        let mut cells = Vec::new();
        for _ in 0..100 {
            for size in [1.0, 3.0] {
                let sum = (0..25).map(|_| (size * dice.gauss()).powi(2)).sum::<f64>();
                cells.push((sum, 25.0));
            }
        }
        let cells = Cells::new(2, cells);
        let sliced = cells.sliced(1, 0);
        assert!(sliced[1].share > 0.95 && sliced[1].p < 1e-6 && sliced[0].p > 0.99);
        approx::assert_abs_diff_eq!(sliced[1].excess, 8.0, epsilon = SLICE_EXCESS);
        assert!(sliced[1].interval[0] < 8.3 && sliced[1].interval[1] > 7.7);
        assert!(sliced[0].interval[0] < 0.1 && sliced[0].interval[1] > -0.1);
        assert_eq!(cells.sliced(1, 0), sliced);
    }
}
