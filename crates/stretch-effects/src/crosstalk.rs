//! Another channel that talks across.

use crate::operator::{Operator, Span};

/// y = x + c z (1 + bend z), z = (other - middle)/span, the other channel where the [`Span`] holds the strain.
///
/// ```
/// use stretch_effects::{Crosstalk, Grid, Operator, Span};
/// let talk = Crosstalk { c: 0.5, bend: 0.0, middle: 10.0, span: 20.0 };
/// let (grid, mut shown) = (Grid::samples(0.01)?, [1.0, 1.0]);
/// talk.run(&Span { strain: &[10.0, 20.0], ..Span::whole(&grid) }, &mut [], &mut shown);
/// assert_eq!(shown, [1.0, 1.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crosstalk {
    /// What one span of the other channel does, in the unit of the signal.
    pub c: f64,
    /// How much it bends.
    pub bend: f64,
    /// Value of the other channel that does nothing.
    pub middle: f64,
    /// From its least to its greatest value.
    pub span: f64,
}

impl Operator for Crosstalk {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, other) in signal.iter_mut().zip(span.strain) {
            let z = (other - self.middle) / self.span;
            *x += self.c * z * (1.0 + self.bend * z);
        }
    }
}
