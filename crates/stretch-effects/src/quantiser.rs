//! A converter's steps.

use crate::operator::{Operator, Span};

/// Rounds to steps: y = step round(x/step), halves away from zero.
///
/// ```
/// use stretch_effects::{Grid, Operator, Quantiser, Span};
/// let mut length_mm = [0.1, 0.4, -0.25];
/// Quantiser { step: 0.25 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut length_mm);
/// assert_eq!(length_mm, [0.0, 0.5, -0.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiser {
    /// A step, in the unit of the signal.
    pub step: f64,
}

impl Operator for Quantiser {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for x in signal {
            *x = libm::round(*x / self.step) * self.step;
        }
    }
}
