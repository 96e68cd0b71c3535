//! The curve of an observer: a piecewise linear function that is fitted by least squares and then made increasing.

use stretch_core::Interval;

use super::least_squares::{LinearFactor, RowAccumulator};

/// Number of knots of the curve.
pub(crate) const KNOTS: usize = 25;
/// Weight of the curve's second differences relative to a sample's residual.
const BEND: f64 = 1e-3;

/// Smallest rise of a curve over its whole length, as a share of the signal's range.
pub(crate) const LEAST_RISE: f64 = 1e-3;

/// Returns the range of the values without the lowest and the highest 0.02 % of them; `None` if the range is empty.
pub(crate) fn inner(mut all: Vec<f64>) -> Option<Interval> {
    let edge = all.len() / 5000;
    let last = all.len().checked_sub(1 + edge)?;
    let min = *all.select_nth_unstable_by(edge, f64::total_cmp).1;
    let max = *all.select_nth_unstable_by(last, f64::total_cmp).1;
    (min < max).then_some(Interval { min, max })
}

/// Position of a drive on the curve. The drive is the input of the curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// Index of the knot below the drive.
    pub(crate) below: usize,
    /// Share of the distance to the next knot.
    pub(crate) share: f64,
}

impl Place {
    pub(crate) fn new(drive: f64, domain: Interval) -> Self {
        let most = (KNOTS - 1) as f64;
        let at = ((drive - domain.min) / (domain.max - domain.min)).clamp(0.0, 1.0) * most;
        let below = (at as usize).min(KNOTS - 2);
        Self { below, share: at - below as f64 }
    }

    /// Returns the value of the curve at this position.
    pub(crate) fn on(self, curve: &[f64]) -> f64 {
        curve[self.below] + self.share * (curve[self.below + 1] - curve[self.below])
    }

    /// Returns the slope of the curve at this position, per unit of drive.
    pub(crate) fn slope(self, curve: &[f64], domain: Interval) -> f64 {
        let per_knot = (KNOTS - 1) as f64 / (domain.max - domain.min);
        (curve[self.below + 1] - curve[self.below]) * per_knot
    }
}

/// Accumulates least-squares rows for the knots and for further terms. A sample involves two knots only, so samples
/// between the same two knots are first folded into a small triangle.
pub(crate) struct CurveRows {
    between: Vec<RowAccumulator>,
    samples: usize,
    more: usize,
    row: Vec<f64>,
}

impl CurveRows {
    /// Creates an empty accumulator for the knots and `more` further terms.
    pub(crate) fn new(more: usize) -> Self {
        let between = vec![RowAccumulator::new(2 + more); KNOTS - 1];
        Self { between, samples: 0, more, row: Vec::new() }
    }

    /// Adds a sample at a position on the curve, with its further terms.
    pub(crate) fn push(&mut self, at: Place, more: &[f64], value: f64) {
        self.row.clear();
        self.row.extend([1.0 - at.share, at.share]);
        self.row.extend(more);
        self.between[at.below].push(&self.row, value);
        self.samples += 1;
    }

    /// Returns the triangular factor of all rows and of the penalty on the curve's bending. The knots are the first
    /// terms.
    pub(crate) fn factor(self) -> LinearFactor {
        let mut rows = RowAccumulator::new(KNOTS + self.more);
        for (below, part) in self.between.into_iter().enumerate() {
            let place = |term| if term < 2 { below + term } else { KNOTS - 2 + term };
            rows.absorb(&part.factor(), place);
        }
        let bend = (BEND * self.samples as f64).sqrt();
        for k in 1..KNOTS - 1 {
            rows.push_at(&[(k - 1, bend), (k, -2.0 * bend), (k + 1, bend)], 0.0);
        }
        rows.factor()
    }
}

/// Returns the nearest curve that rises by at least `step` from knot to knot. Neighbouring knots that violate this are
/// averaged (Ayer et al. 1955, doi:10.1214/aoms/1177728423).
pub(crate) fn rising(knots: &[f64], step: f64) -> Vec<f64> {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (k, knot) in knots.iter().enumerate() {
        pools.push((knot - step * k as f64, 1));
        while let [.., (a, n), (b, m)] = pools[..]
            && a >= b
        {
            pools.truncate(pools.len() - 2);
            let count = n + m;
            pools.push(((a * n as f64 + b * m as f64) / count as f64, count));
        }
    }
    let flat = pools.iter().flat_map(|&(level, count)| std::iter::repeat_n(level, count));
    flat.enumerate().map(|(k, level)| level + step * k as f64).collect()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use testkit::tolerance::F64_ROUNDING;

    use super::rising;

    #[test]
    fn pools_are_averaged_and_rising_curves_kept() {
        assert_eq!(rising(&[0.0, 2.0, 1.0, 3.0], 0.0), [0.0, 1.5, 1.5, 3.0]);
        assert_eq!(rising(&[0.0, 1.0, 2.0], 0.5), [0.0, 1.0, 2.0]);
        let least = rising(&[3.0, 2.0, 1.0], 0.5);
        for pair in least.windows(2) {
            assert_abs_diff_eq!(pair[1] - pair[0], 0.5, epsilon = F64_ROUNDING);
        }
    }
}
