//! Memory that fades, with one time constant or several.

use alloc::vec::Vec;

use crate::{
    grid::Grid,
    mean_reversion::MeanReversion,
    operator::{Operator, Span, Start},
};

/// One time constant, or three of equal weight around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// The middle one, s.
    pub tau_s: f64,
    /// Ratio of each to the next shorter one; 1 makes all of them one.
    pub spread: f64,
}

impl Times {
    /// The time constants: tau, or tau {1/spread, 1, spread}.
    ///
    /// ```
    /// use stretch_effects::Times;
    /// assert_eq!(Times { tau_s: 3.0, spread: 1.0 }.all(), [3.0]);
    /// assert_eq!(Times { tau_s: 3.0, spread: 2.0 }.all(), [1.5, 3.0, 6.0]);
    /// ```
    pub fn all(self) -> Vec<f64> {
        let Self { tau_s, spread } = self;
        if spread == 1.0 {
            return [tau_s].into();
        }
        [tau_s / spread, tau_s, tau_s * spread].into()
    }
}

/// Relaxation, or creep where the share is negative: y = x + share (x - mean of mean_rev(x, tau)).
///
/// A step of the input comes through as 1 + share and fades to 1.
///
/// ```
/// use stretch_effects::{FadingMemory, Grid, Operator, Span, Start, Times};
/// let grid = Grid::samples(0.01)?;
/// let relaxes = FadingMemory::new(0.5, Times { tau_s: 0.1, spread: 1.6 }, 1.0, &grid);
/// let mut cells = vec![0.0; relaxes.cells()];
/// let mut signal = vec![1.0; 500];
/// relaxes.begin(Start::Settled, 0.0, &mut cells);
/// relaxes.run(&Span::whole(&grid), &mut cells, &mut signal);
/// assert!(signal[1] > 1.4 && (signal[499] - 1.0).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FadingMemory {
    share: f64,
    lags: Vec<MeanReversion>,
}

impl FadingMemory {
    /// Of a share and time constants on a grid; `reach` is the stroke of the input, for what is wound by a move.
    pub fn new(share: f64, times: Times, reach: f64, grid: &Grid) -> Self {
        let lags = times.all().into_iter().map(|tau| MeanReversion::new(tau, reach, grid));
        Self { share, lags: lags.collect() }
    }
}

impl Operator for FadingMemory {
    fn cells(&self) -> usize {
        self.lags.len() * MeanReversion::CELLS
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (lag, own) in self.lags.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            lag.begin(start, first, own);
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if let [lag] = self.lags.as_slice() {
            return lag.run(span, cells, signal, |x, z| x + self.share * (x - z));
        }
        let share = self.share / self.lags.len() as f64;
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            let all = self.lags.iter().zip(cells.chunks_mut(MeanReversion::CELLS));
            let apart: f64 = all.map(|(lag, own)| x - lag.step(step, own, x)).sum();
            signal[i] = x + share * apart;
        });
    }
}
