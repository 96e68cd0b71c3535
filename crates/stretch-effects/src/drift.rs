//! A gain that drifts.

use crate::operator::{Operator, Span};

/// Drift of a gain with session time t: y = x (1 + d (1 - exp(-settle t))/settle), or x (1 + d t) where it never settles.
///
/// ```
/// use stretch_effects::{Drift, Grid, Operator, Span};
/// let grid = Grid::samples(1.0)?;
/// let after = |drift: Drift| {
///     let mut gain = [1.0];
///     drift.run(&Span { start_s: 2000.0, ..Span::whole(&grid) }, &mut [], &mut gain);
///     gain[0]
/// };
/// assert_eq!(after(Drift::straight(1e-4)), 1.2);
/// assert!((after(Drift { per_s: 1e-4, settle_per_s: 0.01 }) - 1.01).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Drift at the session's start, d, 1/s.
    pub per_s: f64,
    /// How fast it settles, 1/s; 0 for a straight line.
    pub settle_per_s: f64,
}

impl Drift {
    /// A drift that never settles.
    pub fn straight(per_s: f64) -> Self {
        Self { per_s, settle_per_s: 0.0 }
    }
}

impl Operator for Drift {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        let times = (span.first_node..).map(|node| span.start_s + span.grid.time_s(node));
        if self.settle_per_s == 0.0 {
            for (x, t) in signal.iter_mut().zip(times) {
                *x *= 1.0 + self.per_s * t;
            }
            return;
        }
        let whole = self.per_s / self.settle_per_s;
        for (x, t) in signal.iter_mut().zip(times) {
            *x *= 1.0 - whole * libm::expm1(-self.settle_per_s * t);
        }
    }
}
