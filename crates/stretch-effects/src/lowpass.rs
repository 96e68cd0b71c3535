//! A slow channel: one pole or two.

use alloc::vec::Vec;

use crate::{
    grid::Grid,
    mean_reversion::MeanReversion,
    operator::{Operator, Span, Start},
};

/// The numbers of a [`Lowpass`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poles {
    /// Sum of the time constants, s: how far a ramp is trailed.
    pub tau_s: f64,
    /// Share of it that the second pole has; 0 leaves one pole.
    pub second: f64,
}

/// Low-pass of one or two real poles: y = mean_rev(mean_rev(x, tau (1 - second)), tau second).
///
/// It is powered and settled before every trial, whatever came before.
///
/// ```
/// use stretch_effects::{Grid, Lowpass, Operator, Poles, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// for second in [0.0, 0.3] {
///     let slow = Lowpass::new(Poles { tau_s: 0.1, second }, &grid);
///     let mut cells = vec![0.0; slow.cells()];
///     let mut ramp: Vec<f64> = (0..300).map(|i| 0.01 * i as f64).collect();
///     slow.begin(Start::Settled, 0.0, &mut cells);
///     slow.run(&Span::whole(&grid), &mut cells, &mut ramp);
///     // A ramp is trailed by tau, whatever the poles; the second takes the first's output as linear between samples.
///     assert!((ramp[299] - (2.99 - 0.1)).abs() < 1e-9);
/// }
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Lowpass {
    poles: Vec<MeanReversion>,
}

impl Lowpass {
    /// Of one or two poles on a grid.
    pub fn new(poles: Poles, grid: &Grid) -> Self {
        let Poles { tau_s, second } = poles;
        // It is never wound: its reach does not matter.
        let pole = |tau: f64| MeanReversion::new(tau, 0.0, grid);
        let mut poles = Vec::from([pole(tau_s * (1.0 - second))]);
        if second != 0.0 {
            poles.push(pole(tau_s * second));
        }
        Self { poles }
    }
}

impl Operator for Lowpass {
    fn cells(&self) -> usize {
        self.poles.len() * MeanReversion::CELLS
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        for (pole, own) in self.poles.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            pole.begin(Start::Settled, first, own);
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        for (pole, own) in self.poles.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            pole.run(span, own, signal, |_, z| z);
        }
    }
}
