//! Curves that are not quite lines.

use crate::operator::{Operator, Span};

/// c 4 x (1 - x)(1 + skew (2 x - 1)): zero at 0 and 1, c in the middle, its top off the middle where skewed.
///
/// ```
/// use stretch_effects::bow;
/// assert_eq!(bow(0.1, 0.5, 0.3), 0.1);
/// assert_eq!((bow(0.1, 0.0, 0.3), bow(0.1, 1.0, 0.3)), (0.0, 0.0));
/// assert!(bow(0.1, 0.75, 0.3) > bow(0.1, 0.25, 0.3));
/// ```
#[inline]
pub fn bow(c: f64, x: f64, skew: f64) -> f64 {
    c * 4.0 * x * (1.0 - x) * (1.0 + skew * (2.0 * x - 1.0))
}

/// A scale that bends: y = x + [`bow`]`(c, (x - zero)/span, skew)`.
///
/// [`Operator::undo`] is exact without a skew; with one it is solved by substitution, whose error shrinks in each of eight
/// rounds by the slope of the bow, 4 c/span.
///
/// ```
/// use stretch_effects::{Bow, Grid, Operator, Span};
/// let scale = Bow { c: 0.5, skew: 0.2, zero: 0.0, span: 30.0 };
/// let mut shown = [0.0, 15.0, 30.0];
/// scale.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut shown);
/// assert_eq!(shown, [0.0, 15.5, 30.0]);
/// scale.undo(&mut shown);
/// assert!((shown[1] - 15.0).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bow {
    /// Height in the middle, in the unit of the signal.
    pub c: f64,
    /// How far the top lies off the middle.
    pub skew: f64,
    /// Where the curve begins.
    pub zero: f64,
    /// From there to where it ends, with its sign.
    pub span: f64,
}

impl Operator for Bow {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for x in signal {
            *x += bow(self.c, (*x - self.zero) / self.span, self.skew);
        }
    }

    fn undo(&self, signal: &mut [f64]) {
        let b = 4.0 * self.c / self.span;
        for x in signal {
            if self.skew == 0.0 {
                // z = y + b y (1 - y), solved for y; the form that stays exact as b goes to 0.
                let z = (*x - self.zero) / self.span;
                let sum = 1.0 + b;
                let root = libm::sqrt((sum * sum - 4.0 * b * z).max(0.0));
                *x = self.zero + self.span * (2.0 * z / (sum + root));
            } else {
                let shown = *x;
                for _ in 0..8 {
                    *x = shown - bow(self.c, (*x - self.zero) / self.span, self.skew);
                }
            }
        }
    }
}

/// A gain that bends with the strain e: y = x (1 + [`bow`]`(c, e/scale, skew))`.
///
/// ```
/// use stretch_effects::{BowedGain, Grid, Operator, Span};
/// let gauge = BowedGain { c: 0.1, skew: 0.0, scale: 0.2 };
/// let grid = Grid::samples(0.01)?;
/// let mut ohm = [4.0, 4.0];
/// gauge.run(&Span { strain: &[0.0, 0.1], ..Span::whole(&grid) }, &mut [], &mut ohm);
/// assert_eq!(ohm, [4.0, 4.4]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BowedGain {
    /// Share by which the gain is larger in the middle.
    pub c: f64,
    /// How far the top lies off the middle.
    pub skew: f64,
    /// Strain at which the curve ends.
    pub scale: f64,
}

impl Operator for BowedGain {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, e) in signal.iter_mut().zip(span.strain) {
            *x *= 1.0 + bow(self.c, e / self.scale, self.skew);
        }
    }
}
