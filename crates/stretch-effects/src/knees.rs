//! Bounds with a knee of any sharpness.

use crate::operator::{Operator, Span};

/// A soft lower bound: low + w ln(1 + exp((x - low)/w)); within rounding of x or of `low` from 37 w on.
///
/// ```
/// use stretch_effects::soft_floor;
/// assert_eq!(soft_floor(5.0, 1.0, 0.01), 5.0);
/// assert!((soft_floor(1.0, 1.0, 0.01) - (1.0 + 0.01 * 2f64.ln())).abs() < 1e-15);
/// ```
#[inline]
pub fn soft_floor(x: f64, low: f64, w: f64) -> f64 {
    let z = (x - low) / w;
    if z > 37.0 {
        x
    } else if z > 0.0 {
        x + w * libm::log1p(libm::exp(-z))
    } else {
        low + w * libm::log1p(libm::exp(z))
    }
}

/// A soft upper bound, the mirror image of [`soft_floor`].
///
/// ```
/// use stretch_effects::soft_ceiling;
/// assert_eq!(soft_ceiling(1.0, 5.0, 0.01), 1.0);
/// assert!(soft_ceiling(9.0, 5.0, 0.01) <= 5.0);
/// ```
#[inline]
pub fn soft_ceiling(x: f64, high: f64, w: f64) -> f64 {
    -soft_floor(-x, -high, w)
}

/// Bounds that a signal cannot leave: [`soft_floor`] at `low`, then [`soft_ceiling`] at `high`, where there is one.
///
/// ```
/// use stretch_effects::{Grid, Knees, Operator, Span};
/// let rails = Knees { low: Some(0.5), high: Some(2.0), width: 0.01 };
/// let mut volts = [0.0, 1.2, 3.0];
/// rails.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut volts);
/// assert!(volts[0] >= 0.5 && volts[1] == 1.2 && volts[2] <= 2.0);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knees {
    /// Lower bound.
    pub low: Option<f64>,
    /// Upper bound.
    pub high: Option<f64>,
    /// Width of the knees, in the unit of the signal.
    pub width: f64,
}

impl Operator for Knees {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        if let Some(low) = self.low {
            signal.iter_mut().for_each(|x| *x = soft_floor(*x, low, self.width));
        }
        if let Some(high) = self.high {
            signal.iter_mut().for_each(|x| *x = soft_ceiling(*x, high, self.width));
        }
    }
}
