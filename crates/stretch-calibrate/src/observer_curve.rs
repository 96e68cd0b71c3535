//! An observer's curve: straight lines between knots, and least squares over them.

use stretch_core::Interval;

use crate::least_squares::{LinearFactor, RowAccumulator};

/// Knots of the curve.
pub(crate) const KNOTS: usize = 25;
/// Weight of the curve's second differences against a sample's residual.
const BEND: f64 = 1e-3;

/// Least rise of a curve over its whole length, as a share of the signal's range.
pub(crate) const LEAST_RISE: f64 = 1e-3;

/// The range of the values without the outermost two in ten thousand at either end; `None` where the range is empty.
pub(crate) fn inner(mut all: Vec<f64>) -> Option<Interval> {
    let edge = all.len() / 5000;
    let last = all.len().checked_sub(1 + edge)?;
    let min = *all.select_nth_unstable_by(edge, f64::total_cmp).1;
    let max = *all.select_nth_unstable_by(last, f64::total_cmp).1;
    (min < max).then_some(Interval { min, max })
}

/// A drive's place on the curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The knot below.
    pub(crate) below: usize,
    /// The share of the way to the next.
    pub(crate) share: f64,
}

impl Place {
    pub(crate) fn new(drive: f64, domain: Interval) -> Self {
        let most = (KNOTS - 1) as f64;
        let at = ((drive - domain.min) / (domain.max - domain.min)).clamp(0.0, 1.0) * most;
        let below = (at as usize).min(KNOTS - 2);
        Self { below, share: at - below as f64 }
    }

    /// Value of the curve at the place.
    pub(crate) fn on(self, curve: &[f64]) -> f64 {
        curve[self.below] + self.share * (curve[self.below + 1] - curve[self.below])
    }

    /// Slope of the curve at the place, per unit of drive.
    pub(crate) fn slope(self, curve: &[f64], domain: Interval) -> f64 {
        let per_knot = (KNOTS - 1) as f64 / (domain.max - domain.min);
        (curve[self.below + 1] - curve[self.below]) * per_knot
    }
}

/// Rows over the knots and further terms. A sample touches two knots, so that the samples between the same two knots
/// fold into a small triangle of their own first.
pub(crate) struct CurveRows {
    between: Vec<RowAccumulator>,
    samples: usize,
    more: usize,
    row: Vec<f64>,
}

impl CurveRows {
    /// Rows of the knots and `more` further terms, none yet.
    pub(crate) fn new(more: usize) -> Self {
        let between = vec![RowAccumulator::new(2 + more); KNOTS - 1];
        Self { between, samples: 0, more, row: Vec::new() }
    }

    /// Adds a sample at a place of the curve, with its further terms.
    pub(crate) fn push(&mut self, at: Place, more: &[f64], value: f64) {
        self.row.clear();
        self.row.extend([1.0 - at.share, at.share]);
        self.row.extend(more);
        self.between[at.below].push(&self.row, value);
        self.samples += 1;
    }

    /// The factor of all rows and of the curve's bending: knots first.
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
