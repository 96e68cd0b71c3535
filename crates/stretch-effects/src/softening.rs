//! A response that weakens as it is worked.

use crate::operator::{Operator, Span, Start};

/// Softening with travel: y = zero + (x - zero)(1 - m (1 - left)), left = (1 + tail travel/n)^(-1/tail), which is
/// exp(-travel/n) at a tail of 0. Travel is the summed absolute change of strain since the session began.
///
/// Remembers the travel, the strain reached, and the direction: +1, -1, or 0 before the first move. Source of the long
/// tail: stretched forms of the Mullins effect, Diani 2009, doi:10.1016/j.eurpolymj.2008.11.017.
///
/// ```
/// use stretch_effects::{Grid, Operator, Softening, Span, Start};
/// let gauge = Softening { m: 0.3, n: 2.0, tail: 0.0, zero: 1.0, reversal: 1e-3 };
/// let (grid, mut cells, mut ohm) = (Grid::samples(0.01)?, [0.0; 3], [3.0, 3.0, 3.0]);
/// gauge.begin(Start::Settled, 0.0, &mut cells);
/// let span = Span { strain: &[0.0, 1.0, 0.0], ..Span::whole(&grid) };
/// gauge.run(&span, &mut cells, &mut ohm);
/// assert_eq!((ohm[0], cells[0]), (3.0, 2.0)); // up by one and down again
/// assert!((ohm[2] - (1.0 + 2.0 * (1.0 - 0.3 * (1.0 - (-1.0_f64).exp())))).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    /// Share that is lost in the end.
    pub m: f64,
    /// Travel that takes the first of it, in strain.
    pub n: f64,
    /// How long its tail is; 0 for an exponential.
    pub tail: f64,
    /// Value of the signal at no strain, which stays.
    pub zero: f64,
    /// Reversals smaller than this strain do not travel: noise alone would go a long way.
    pub reversal: f64,
}

impl Softening {
    /// Counts a move to the strain `e`; whether it travelled.
    #[inline]
    fn go(&self, cells: &mut [f64; 3], e: f64) -> bool {
        let [travel, reached, direction] = cells;
        let moved = e - *reached;
        let onward = moved * *direction > 0.0;
        let distance = moved.abs();
        if onward || distance > self.reversal {
            *travel += distance;
            *reached = e;
            if !onward {
                *direction = moved.signum();
            }
            return true;
        }
        false
    }

    /// 1 - m (1 - left).
    #[inline]
    fn factor(&self, travel: f64) -> f64 {
        let exponent = match self.tail {
            0.0 => -travel / self.n,
            tail => -libm::log1p(tail * travel / self.n) / tail,
        };
        1.0 + self.m * libm::expm1(exponent)
    }
}

impl Operator for Softening {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        match start {
            Start::Settled => state = [0.0, first, 0.0],
            Start::Carried { .. } | Start::Wound(_) => {
                self.go(&mut state, first);
            }
        }
        cells.copy_from_slice(&state);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        let mut factor = self.factor(state[0]);
        for (x, e) in signal.iter_mut().zip(span.strain) {
            if self.go(&mut state, *e) {
                factor = self.factor(state[0]);
            }
            *x = self.zero + (*x - self.zero) * factor;
        }
        cells.copy_from_slice(&state);
    }
}
