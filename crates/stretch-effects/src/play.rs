//! Play: a part that follows once its backlash is used up.

use stretch_core::play;

use crate::{
    operator::{Operator, Span, Start},
    play_start::play_start,
    prandtl_ishlinskii::PrandtlIshlinskii,
    unplay::unplay,
};

/// Backlash as an operator: y = play(x, w), or the mean of play(x, w {1 - spread, 1, 1 + spread}), which turns softly.
///
/// [`Operator::undo`] hands back an input that would have made a recorded output: exact while the output moves, led over
/// linearly while it dwells (of a soft one, as if it were hard).
///
/// ```
/// use stretch_effects::{Backlash, Grid, Operator, Span, Start};
/// let slip = Backlash::hard(1.0);
/// let (mut cells, mut signal) = ([0.0], [0.0, 0.5, 3.0, 2.5]);
/// slip.begin(Start::Settled, signal[0], &mut cells);
/// slip.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 0.0, 2.0, 2.0]);
/// assert_eq!(Backlash::soft(1.0, 0.3).cells(), 3);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash {
    w: f64,
    /// A mean of plays is a Prandtl-Ishlinskii operator of share 1.
    soft: Option<PrandtlIshlinskii>,
}

impl Backlash {
    /// One play of half-width `w`, in the unit of the signal.
    pub fn hard(w: f64) -> Self {
        Self { w, soft: None }
    }

    /// Three plays around the half-width `w`, from `1 - spread` to `1 + spread` of it; hard at a spread of 0.
    pub fn soft(w: f64, spread: f64) -> Self {
        let radii = [w * (1.0 - spread), w, w * (1.0 + spread)];
        Self { w, soft: (spread != 0.0).then(|| PrandtlIshlinskii::of_radii(1.0, radii)) }
    }
}

impl Operator for Backlash {
    fn cells(&self) -> usize {
        self.soft.map_or(1, |soft| soft.cells())
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        match &self.soft {
            Some(soft) => soft.begin(start, first, cells),
            None => cells[0] = play_start(start, cells[0], first, self.w),
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if let Some(soft) = &self.soft {
            return soft.run(span, cells, signal);
        }
        let mut z = cells[0];
        for x in signal {
            z = play(z, *x, self.w);
            *x = z;
        }
        cells[0] = z;
    }

    fn undo(&self, signal: &mut [f64]) {
        unplay(self.w, signal);
    }
}
