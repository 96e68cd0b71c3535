//! What an operator is, and what it acts on.

use alloc::{boxed::Box, vec::Vec};
use core::fmt;

use stretch_core::arithmetic::play;

use crate::grid::Grid;

/// How an operator's memory begins a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// At rest at the first value, everything before forgotten.
    Settled,
    /// As the last trial left it: the input went straight to this trial's first value and stayed there for `rest_s`.
    Carried {
        /// Seconds of rest between the trials.
        rest_s: f64,
    },
    /// With the hysteresis state that an unrecorded motion left: +1 as if the input had come up to its first value from far
    /// below, -1 as if it had come from far above, 0 settled; any value between is a share of that reach. A memory that counts the whole
    /// session (the travel of a gauge) goes on as in [`Start::Carried`].
    Hysteresis(f64),
}

impl Start {
    /// Output at which a play of half-width `w` begins a trial at input `first`; `last` is its output before.
    pub(crate) fn of_play(self, last: f64, first: f64, w: f64) -> f64 {
        match self {
            Self::Settled => first,
            Self::Carried { .. } => play(last, first, w),
            Self::Hysteresis(share) => first - share.clamp(-1.0, 1.0) * w,
        }
    }
}

/// The stretch of signal that an operator acts on, and what else is known there.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// Steps of time.
    pub grid: &'a Grid,
    /// Node of the signal's first value; node 0 is emitted without advancing time.
    pub first_node: usize,
    /// Session time of node 0, s: since the gauge was powered and the sleeve first stretched.
    pub start_s: f64,
    /// Gauge pressure at the same nodes, kPa; empty when there is none.
    pub pressure_kpa: &'a [f64],
    /// Gauge strain at the same nodes, after the effects on it; empty where it is not yet known.
    pub strain: &'a [f64],
    /// What loads a contact at the same nodes; empty when there is nothing.
    pub load: &'a [f64],
}

impl<'a> Span<'a> {
    /// From node 0 on, in a session that begins with it, without pressure or strain.
    pub fn whole(grid: &'a Grid) -> Self {
        Self { grid, first_node: 0, start_s: 0.0, pressure_kpa: &[], strain: &[], load: &[] }
    }
}

impl Span<'_> {
    /// Calls `visit(step, i)` for every value: `step` is the index of the piece of time that leads to it, none at node 0.
    #[inline]
    pub fn each(&self, len: usize, mut visit: impl FnMut(Option<usize>, usize)) {
        let mut i = 0;
        if self.first_node == 0 && len > 0 {
            visit(None, 0);
            i = 1;
        }
        let pieces = self.grid.pieces();
        if pieces == 1 {
            while i < len {
                visit(Some(0), i);
                i += 1;
            }
            return;
        }
        let mut step = (self.first_node + i + pieces - 1) % pieces;
        while i < len {
            visit(Some(step), i);
            step = if step + 1 == pieces { 0 } else { step + 1 };
            i += 1;
        }
    }
}

/// Something that changes a signal in place, sample by sample, with a memory of `cells()` numbers.
///
/// The memory is the caller's: the operator itself never changes, so one serves many channels.
///
/// ```
/// use stretch_effects::{Grid, Operator, Span, Start};
///
/// /// y = x - x before.
/// #[derive(Debug)]
/// struct Difference;
/// impl Operator for Difference {
///     fn cells(&self) -> usize {
///         1
///     }
///     fn begin(&self, _: Start, first: f64, cells: &mut [f64]) {
///         cells[0] = first;
///     }
///     fn run(&self, _: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
///         for x in signal {
///             (*x, cells[0]) = (*x - cells[0], *x);
///         }
///     }
/// }
/// let (mut cells, mut signal) = ([0.0], [2.0, 5.0, 4.0]);
/// Difference.begin(Start::Settled, signal[0], &mut cells);
/// Difference.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 3.0, -1.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
pub trait Operator: fmt::Debug + Send + Sync {
    /// How many numbers it remembers.
    fn cells(&self) -> usize {
        0
    }

    /// Prepares the memory for a trial whose first input is `first`; by default every number is that.
    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        cells.fill(first);
    }

    /// Replaces every value of `signal` by what the operator makes of it.
    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]);

    /// Replaces a recorded output by the input that made it, as far as that is possible; by default it leaves it alone.
    fn undo(&self, _signal: &mut [f64]) {}
}

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
