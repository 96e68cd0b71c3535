//! The `Operator` trait, the signal segment that an operator acts on, and rows of operators in series.

use alloc::{boxed::Box, vec::Vec};
use core::fmt;

use stretch_core::arithmetic::play;

use crate::grid::Grid;

/// How an operator's memory begins a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// At rest at the first value. Everything before the trial is forgotten.
    Settled,
    /// Continued from the end of the last trial. Between the trials the input moved straight to this trial's first
    /// value and stayed there for `rest_s`.
    Carried {
        /// Seconds of rest between the trials.
        rest_s: f64,
    },
    /// With the hysteresis state that an unrecorded motion before the trial left. At +1 the input reached its first
    /// value from far below, at -1 from far above. At 0 the state is settled; values in between scale the state. A
    /// memory that accumulates over the whole session (the travel of a gauge) continues as in [`Start::Carried`].
    Hysteresis(f64),
}

impl Start {
    /// Returns the output at which a play (backlash) of half-width `w` begins a trial at input `first`. `last` is the
    /// play's previous output.
    pub(crate) fn of_play(self, last: f64, first: f64, w: f64) -> f64 {
        match self {
            Self::Settled => first,
            Self::Carried { .. } => play(last, first, w),
            Self::Hysteresis(share) => first - share.clamp(-1.0, 1.0) * w,
        }
    }
}

/// The time base of the signal segment on which an operator acts, and the other signals at the same nodes.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// Grid of integration steps.
    pub grid: &'a Grid,
    /// Node of the signal's first value. No time step precedes node 0.
    pub first_node: usize,
    /// Session time of node 0, s. The session begins when the gauge is powered and the sleeve is first stretched.
    pub start_s: f64,
    /// Gauge pressure (above the atmosphere) at the same nodes, kPa; empty if there is none.
    pub pressure_kpa: &'a [f64],
    /// Gauge strain at the same nodes, after the effects on it; empty if it is not yet known. Operators with another
    /// second signal (a velocity, a position, another channel) read that signal from this field.
    pub strain: &'a [f64],
    /// Signal that loads a contact, at the same nodes; empty if there is none.
    pub load: &'a [f64],
}

impl<'a> Span<'a> {
    /// A span that starts at node 0 and at session time 0, without pressure, strain or load.
    pub fn whole(grid: &'a Grid) -> Self {
        Self { grid, first_node: 0, start_s: 0.0, pressure_kpa: &[], strain: &[], load: &[] }
    }
}

impl Span<'_> {
    /// Calls `visit(step, i)` for every value. `step` is the index of the grid step that leads to value `i`; it is
    /// `None` at node 0.
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

/// An operation that changes a signal in place, sample by sample, with a memory of `cells()` numbers.
///
/// The caller owns the memory. The operator itself never changes, so one operator serves many channels.
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
    /// Number of values that the operator remembers.
    fn cells(&self) -> usize {
        0
    }

    /// Prepares the memory for a trial whose first input is `first`. By default every value is set to `first`.
    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        cells.fill(first);
    }

    /// Replaces every input value in `signal` by the operator's output.
    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]);

    /// Replaces a recorded output by an input that produces it, as far as possible. By default the signal is left
    /// unchanged.
    fn undo(&self, _signal: &mut [f64]) {}
}

/// Operators that act in series on one signal, with the position of each operator's memory in the caller's cells.
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
    /// A row whose memory begins at index `offset` of the caller's cells.
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

    /// Index of the first cell after this row's memory.
    pub fn end(&self) -> usize {
        self.offset + self.cells
    }

    /// Whether the row has no operators.
    pub fn is_empty(&self) -> bool {
        self.row.is_empty()
    }

    /// Begins a trial at the input `first` and returns the row's output there. `span` describes node 0 and holds one
    /// value of each signal.
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

    /// Begins a trial like [`begin`](Self::begin), for operators whose memory follows the strain and not the signal.
    /// Every operator begins at `state`; none is run.
    pub fn begin_at(&self, start: Start, state: f64, cells: &mut [f64]) {
        for (operator, at) in &self.row {
            let at = self.offset + at;
            operator.begin(start, state, &mut cells[at..at + operator.cells()]);
        }
    }

    /// Runs the operators in order on a segment of the signal.
    pub fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        for (operator, at) in &self.row {
            let at = self.offset + at;
            operator.run(span, &mut cells[at..at + operator.cells()], signal);
        }
    }

    /// Undoes the operators in reverse order on a whole recording.
    pub fn undo(&self, signal: &mut [f64]) {
        for (operator, _) in self.row.iter().rev() {
            operator.undo(signal);
        }
    }
}
