//! Mains hum on recorded samples.

use core::f64::consts::TAU;

use crate::operator::{Operator, Span};

/// A sine on samples: y = x + a sin(2 pi f t + phase), t session time.
///
/// ```
/// use stretch_effects::{Grid, Hum, Operator, Span};
/// let hum = Hum { a: 0.1, f_hz: 60.0, phase: 1.0 };
/// let mut volts = [0.0; 100];
/// hum.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut volts);
/// let wanted = |i: f64| 0.1 * (std::f64::consts::TAU * 60.0 * 0.01 * i + 1.0).sin();
/// assert!((volts[0] - wanted(0.0)).abs() < 1e-12 && (volts[99] - wanted(99.0)).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hum {
    /// Amplitude, in the unit of the signal.
    pub a: f64,
    /// Frequency, Hz.
    pub f_hz: f64,
    /// Phase at the session's start, rad.
    pub phase: f64,
}

impl Operator for Hum {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        // Samples, not nodes: a rotation by the same angle each, exact again every 256 samples.
        let turn = TAU * self.f_hz * span.grid.dt_s();
        let (sin_turn, cos_turn) = (libm::sin(turn), libm::cos(turn));
        for (block, samples) in signal.chunks_mut(256).enumerate() {
            let sample = span.first_node / span.grid.pieces() + 256 * block;
            let t = span.start_s + sample as f64 * span.grid.dt_s();
            // Whole turns are taken off before the angle grows large.
            let turns = self.f_hz * t;
            let angle = TAU * (turns - libm::floor(turns)) + self.phase;
            let (mut sin, mut cos) = (libm::sin(angle), libm::cos(angle));
            for v in samples {
                *v += self.a * sin;
                (sin, cos) = (sin * cos_turn + cos * sin_turn, cos * cos_turn - sin * sin_turn);
            }
        }
    }
}
