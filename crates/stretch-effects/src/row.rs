//! A row of operators that act one after the other on one signal.

use alloc::{boxed::Box, vec::Vec};

use crate::operator::{Operator, Span, Start};

/// Operators that act one after the other on one signal, and where each keeps its memory in a caller's cells.
///
/// ```
/// use stretch_effects::{Backlash, Drift, Grid, Row, Span, Start};
/// let row = Row::new(vec![Box::new(Backlash::hard(0.5)), Box::new(Drift::straight(0.1))], 0);
/// let grid = Grid::samples(1.0)?;
/// let span = Span::whole(&grid);
/// let mut cells = vec![0.0; row.end()];
/// let mut signal = [0.0, 2.0, 1.0];
/// row.begin(&span, Start::Settled, signal[0], &mut cells);
/// row.run(&span, &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 1.5 * 1.1, 1.5 * 1.2]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Default)]
pub struct Row {
    row: Vec<(Box<dyn Operator>, usize)>,
    offset: usize,
    cells: usize,
}

impl Row {
    /// A row whose memory begins at `offset` of the caller's cells.
    pub fn new(row: Vec<Box<dyn Operator>>, offset: usize) -> Self {
        let mut cells = 0;
        let row = row
            .into_iter()
            .map(|operator| {
                let at = cells;
                cells += operator.cells();
                (operator, at)
            })
            .collect();
        Self { row, offset, cells }
    }

    /// First cell behind this row's.
    pub fn end(&self) -> usize {
        self.offset + self.cells
    }

    /// Whether nothing acts.
    pub fn is_empty(&self) -> bool {
        self.row.is_empty()
    }

    /// Begins a trial at the input `first`; returns the row's output there. `span` describes node 0 and holds one value of each signal.
    pub fn begin(&self, span: &Span<'_>, start: Start, first: f64, cells: &mut [f64]) -> f64 {
        let mut x = [first];
        for (operator, at) in &self.row {
            let at = self.offset + at;
            let own = &mut cells[at..at + operator.cells()];
            operator.begin(start, x[0], own);
            operator.run(span, own, &mut x);
        }
        x[0]
    }

    /// As [`begin`](Self::begin) for an operator whose input at the start is the strain, not the signal.
    pub fn begin_at(&self, start: Start, state: f64, cells: &mut [f64]) {
        for (operator, at) in &self.row {
            let at = self.offset + at;
            operator.begin(start, state, &mut cells[at..at + operator.cells()]);
        }
    }

    /// Acts on a stretch of the signal.
    pub fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        for (operator, at) in &self.row {
            let at = self.offset + at;
            operator.run(span, &mut cells[at..at + operator.cells()], signal);
        }
    }

    /// Undoes the row, last first, on a whole record.
    pub fn undo(&self, signal: &mut [f64]) {
        for (operator, _) in self.row.iter().rev() {
            operator.undo(signal);
        }
    }
}
