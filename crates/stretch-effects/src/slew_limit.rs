//! A channel that cannot change faster than a rate.

use crate::operator::{Operator, Span, Start};

/// Bounds the rate: y goes towards x by at most rate h in a step of length h. Remembers y.
///
/// ```
/// use stretch_effects::{Grid, Operator, SlewLimit, Span, Start};
/// let (mut cells, mut signal) = ([0.0], [0.0, 1.0, 1.0, 1.0, 0.875]);
/// let valve = SlewLimit { rate: 4.0 };
/// valve.begin(Start::Settled, signal[0], &mut cells);
/// valve.run(&Span::whole(&Grid::samples(0.125)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 0.5, 1.0, 1.0, 0.875]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlewLimit {
    /// Greatest rate, units/s, above 0.
    pub rate: f64,
}

impl Operator for SlewLimit {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = first;
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut y = cells[0];
        span.each(signal.len(), |step, i| {
            let most = step.map_or(f64::INFINITY, |step| self.rate * span.grid.steps()[step]);
            let apart = signal[i] - y;
            // Within reach it is the value itself, to the last bit.
            y = if apart.abs() <= most { signal[i] } else { y + most.copysign(apart) };
            signal[i] = y;
        });
        cells[0] = y;
    }
}
