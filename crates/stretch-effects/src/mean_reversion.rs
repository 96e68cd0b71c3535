//! The first-order lag.

use alloc::vec::Vec;

use stretch_core::lag_weights;

use crate::{
    grid::Grid,
    operator::{Span, Start},
};

/// First-order lag (mean reversion) z' = (x - z)/tau, exact for an input that is linear between nodes.
///
/// ```
/// use stretch_effects::{Grid, MeanReversion, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let lag = MeanReversion::new(0.1, 1.0, &grid);
/// let mut cells = [0.0; MeanReversion::CELLS];
/// lag.begin(Start::Settled, 0.0, &mut cells);
/// // A ramp of slope 1: the lag trails it by tau (1 - exp(-t/tau)).
/// let mut signal: Vec<f64> = (0..101).map(|i| 0.01 * i as f64).collect();
/// lag.run(&Span::whole(&grid), &mut cells, &mut signal, |_, z| z);
/// assert!((signal[100] - (1.0 - 0.1 * (1.0 - (-10.0_f64).exp()))).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct MeanReversion {
    tau: f64,
    reach: f64,
    /// For each piece of time: weights of z, the last x and the new x.
    weights: Vec<[f64; 3]>,
}

impl MeanReversion {
    /// How many numbers it remembers: its state and its last input.
    pub const CELLS: usize = 2;

    /// Of time constant `tau` (s, positive) on a grid; `reach` is the stroke of its input, in the input's unit.
    pub fn new(tau: f64, reach: f64, grid: &Grid) -> Self {
        Self { tau, reach, weights: grid.steps().iter().map(|h| lag_weights(*h, tau)).collect() }
    }

    /// Prepares the memory, as [`Operator::begin`](crate::Operator::begin).
    pub fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = match start {
            Start::Settled => first,
            Start::Carried { rest_s } => first + (cells[0] - first) * libm::exp(-rest_s / self.tau),
            Start::Hysteresis(share) => first - share.clamp(-1.0, 1.0) * self.reach,
        };
        cells[1] = first;
    }

    /// State after the input `x`, `step` the piece of time that leads to it.
    #[inline]
    pub(crate) fn step(&self, step: Option<usize>, cells: &mut [f64], x: f64) -> f64 {
        if let Some(step) = step {
            let [of_z, of_last, of_x] = self.weights[step];
            cells[0] = of_z * cells[0] + (of_last * cells[1] + of_x * x);
        }
        cells[1] = x;
        cells[0]
    }

    /// Replaces every x by `mix(x, z)`.
    #[inline]
    pub fn run(
        &self,
        span: &Span<'_>,
        cells: &mut [f64],
        signal: &mut [f64],
        mix: impl Fn(f64, f64) -> f64,
    ) {
        let mut own = [cells[0], cells[1]];
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            signal[i] = mix(x, self.step(step, &mut own, x));
        });
        cells[..2].copy_from_slice(&own);
    }
}
