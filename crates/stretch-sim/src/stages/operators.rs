//! A row of operators that act one after the other on one signal.

use crate::operator::{Operator, Span, Start};

/// Operators and where each keeps its memory in the stage's cells.
#[derive(Debug, Default)]
pub(crate) struct Operators {
    row: Vec<(Box<dyn Operator>, usize)>,
    offset: usize,
    cells: usize,
}

impl Operators {
    /// A row whose memory begins at `offset` of the stage's cells.
    pub(crate) fn new(row: Vec<Box<dyn Operator>>, offset: usize) -> Self {
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
    pub(crate) fn end(&self) -> usize {
        self.offset + self.cells
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.row.is_empty()
    }

    /// Begins a trial at the input `first`; returns the row's output there. `span` describes node 0 and holds one value of each signal.
    pub(crate) fn begin(
        &self,
        span: &Span<'_>,
        start: Start,
        first: f64,
        cells: &mut [f64],
    ) -> f64 {
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
    pub(crate) fn begin_at(&self, start: Start, state: f64, cells: &mut [f64]) {
        for (operator, at) in &self.row {
            let at = self.offset + at;
            operator.begin(start, state, &mut cells[at..at + operator.cells()]);
        }
    }

    /// Acts on a stretch of the signal.
    pub(crate) fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        for (operator, at) in &self.row {
            let at = self.offset + at;
            operator.run(span, &mut cells[at..at + operator.cells()], signal);
        }
    }

    /// Undoes the row, last first, on a whole record.
    pub(crate) fn undo(&self, signal: &mut [f64]) {
        for (operator, _) in self.row.iter().rev() {
            operator.undo(signal);
        }
    }
}
