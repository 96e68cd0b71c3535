//! Friction by direction and speed.

use crate::operator::{Operator, Span};

/// A force that rubs: y = x + F(v), with the velocity v where the [`Span`] holds the strain,
///
/// ```text
/// F(v) = tanh(v/width) (coulomb + more exp(-(v/slow)^2)) (1 + lopsided sign(v)) + viscous v
/// ```
///
/// Source of the form: Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7.
///
/// ```
/// use stretch_effects::{Friction, Grid, Operator, Span};
/// let rail = Friction { coulomb: 20.0, viscous: 2.0, ..Friction::default() };
/// let (grid, mut force) = (Grid::samples(0.01)?, [0.0, 0.0, 0.0]);
/// rail.run(&Span { strain: &[-1.0, 0.0, 0.5], ..Span::whole(&grid) }, &mut [], &mut force);
/// assert_eq!(force, [-22.0, 0.0, 21.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Friction {
    /// Force against any motion.
    pub coulomb: f64,
    /// Force per velocity.
    pub viscous: f64,
    /// Force that comes on top while it is slow (Stribeck).
    pub more: f64,
    /// Velocity up to which that lasts.
    pub slow: f64,
    /// Velocity at which the direction is told; 0 for at once.
    pub width: f64,
    /// By which share more it rubs forward than backward, halved.
    pub lopsided: f64,
}

impl Friction {
    /// F(v).
    #[inline]
    pub fn force(&self, v: f64) -> f64 {
        let side = match self.width {
            _ if v == 0.0 => 0.0,
            0.0 => v.signum(),
            width => libm::tanh(v / width),
        };
        let slow = match self.more {
            0.0 => 0.0,
            more => more * libm::exp(-(v / self.slow) * (v / self.slow)),
        };
        side * (self.coulomb + slow) * (1.0 + self.lopsided * v.signum()) + self.viscous * v
    }
}

impl Operator for Friction {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, v) in signal.iter_mut().zip(span.strain) {
            *x += self.force(*v);
        }
    }
}
