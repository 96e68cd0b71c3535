//! Prandtl-Ishlinskii hysteresis.

use stretch_core::play;

use crate::{
    operator::{Operator, Span, Start},
    play_start::play_start,
};

/// The numbers of a [`PrandtlIshlinskii`] operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loops {
    /// Share of a small move that is held back.
    pub h: f64,
    /// Largest half-width, in the unit of the signal.
    pub s: f64,
    /// Ratio of each half-width to the next larger one.
    pub spread: f64,
}

/// Hysteresis without a rate: y = x - h mean of (x - play(x, r)), r = s {spread^2, spread, 1}.
///
/// Source: Kuhnen 2003, doi:10.3166/ejc.9.407-418.
///
/// ```
/// use stretch_effects::{Grid, Loops, Operator, PrandtlIshlinskii, Span, Start};
/// let gauge = PrandtlIshlinskii::new(Loops { h: 0.3, s: 0.4, spread: 0.5 });
/// let (mut cells, mut signal) = ([0.0; 3], [0.0, 1.0, 0.0]);
/// gauge.begin(Start::Settled, signal[0], &mut cells);
/// gauge.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// // Rising it is h mean(r) behind, falling as much ahead: mean(r) = (0.1 + 0.2 + 0.4)/3.
/// assert!((signal[1] - (1.0 - 0.07)).abs() < 1e-15 && (signal[2] - 0.07).abs() < 1e-15);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrandtlIshlinskii {
    h: f64,
    radii: [f64; 3],
}

impl PrandtlIshlinskii {
    /// Of a share, a largest half-width and a spread.
    pub fn new(loops: Loops) -> Self {
        let Loops { h, s, spread } = loops;
        Self::of_radii(h, [s * spread * spread, s * spread, s])
    }

    pub(crate) fn of_radii(h: f64, radii: [f64; 3]) -> Self {
        Self { h, radii }
    }
}

impl Operator for PrandtlIshlinskii {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (z, r) in cells.iter_mut().zip(self.radii) {
            *z = play_start(start, *z, first, r);
        }
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut a, mut b, mut c] = [cells[0], cells[1], cells[2]];
        let share = self.h / 3.0;
        for x in signal {
            a = play(a, *x, self.radii[0]);
            b = play(b, *x, self.radii[1]);
            c = play(c, *x, self.radii[2]);
            *x -= share * ((*x - a) + (*x - b) + (*x - c));
        }
        cells.copy_from_slice(&[a, b, c]);
    }
}
