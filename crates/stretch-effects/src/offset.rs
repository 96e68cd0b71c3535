//! A zero that is off, and wanders.

use crate::operator::{Operator, Span};

/// An offset with session time t: y = x + at_start + per_s t.
///
/// ```
/// use stretch_effects::{Grid, Offset, Operator, Span};
/// let grid = Grid::samples(1.0)?;
/// let mut shown = [1.0, 1.0];
/// Offset { at_start: 0.5, per_s: 0.25 }.run(&Span { start_s: 2.0, ..Span::whole(&grid) }, &mut [], &mut shown);
/// assert_eq!(shown, [2.0, 2.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Offset {
    /// At the session's start, in the unit of the signal.
    pub at_start: f64,
    /// How it wanders, units/s.
    pub per_s: f64,
}

impl Operator for Offset {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, node) in signal.iter_mut().zip(span.first_node..) {
            *x += self.at_start + self.per_s * (span.start_s + span.grid.time_s(node));
        }
    }
}
