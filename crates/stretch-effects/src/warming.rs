//! A gain that warms up.

use alloc::vec::Vec;

use crate::{
    fading::Times,
    grid::Grid,
    operator::{Operator, Span, Start},
};

/// Warming after switching on: y = x (1 + h (1 - mean of exp(-t/tau))), t since the trial's start.
/// Remembers what is still to warm up, one number a time constant.
///
/// ```
/// use stretch_effects::{Grid, Operator, Span, Start, Times, Warming};
/// let grid = Grid::samples(0.1)?;
/// let heats = Warming::new(0.02, Times { tau_s: 1.0, spread: 1.0 }, &grid);
/// let (mut cells, mut gain) = ([0.0], vec![1.0; 200]);
/// heats.begin(Start::Settled, 1.0, &mut cells);
/// heats.run(&Span::whole(&grid), &mut cells, &mut gain);
/// assert_eq!(gain[0], 1.0);
/// assert!((gain[10] - (1.0 + 0.02 * (1.0 - (-1.0_f64).exp()))).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Warming {
    h: f64,
    /// Time constants.
    count: usize,
    /// What a piece of time leaves, one time constant after the other.
    decays: Vec<f64>,
}

impl Warming {
    /// By a share `h` in the end, with these time constants, on a grid.
    pub fn new(h: f64, times: Times, grid: &Grid) -> Self {
        let taus = times.all();
        let left = |step: &f64| taus.iter().map(|tau| libm::exp(-step / tau)).collect::<Vec<_>>();
        Self { h, count: taus.len(), decays: grid.steps().iter().flat_map(left).collect() }
    }
}

impl Operator for Warming {
    fn cells(&self) -> usize {
        self.count
    }

    fn begin(&self, _start: Start, _first: f64, cells: &mut [f64]) {
        cells.fill(1.0);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let count = self.count as f64;
        span.each(signal.len(), |step, i| {
            if let Some(step) = step {
                let decays = &self.decays[step * self.count..];
                cells.iter_mut().zip(decays).for_each(|(left, decay)| *left *= decay);
            }
            signal[i] *= 1.0 + self.h * (1.0 - cells.iter().sum::<f64>() / count);
        });
    }
}
