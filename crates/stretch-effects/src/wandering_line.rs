//! A line whose phase wanders: found in a record, second by second.

use core::f64::consts::TAU;

/// Window in which the phase is taken as steady, s.
const WINDOW_S: f64 = 1.0;

/// A hum of known amplitude and frequency whose phase nothing foretells.
///
/// ```
/// use stretch_effects::WanderingLine;
/// let wave = |i: usize| 0.1 * (std::f64::consts::TAU * 50.0 * 0.004 * i as f64 + 0.7).sin();
/// let measured: Vec<f64> = (0..500).map(wave).collect();
/// let mut simulated = vec![0.0; 500];
/// WanderingLine { a: 0.1, f_hz: 50.0 }.follow(&measured, 0.01, 0.004, &mut simulated);
/// assert!(measured.iter().zip(&simulated).all(|(m, s)| (m - s).abs() < 2e-3));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WanderingLine {
    /// Amplitude, in the unit of the samples.
    pub a: f64,
    /// Frequency, Hz.
    pub f_hz: f64,
}

impl WanderingLine {
    /// Adds to samples that may be fitted the hum whose phase in each second is the one that the measured record shows: as much of
    /// the residual at the line's frequency as the amplitude allows; noise shrinks what it cannot tell. Each sample is foretold by
    /// the others of its second. `noise` is one standard deviation of the measured samples, which are as many as the simulated ones or more.
    pub fn follow(&self, measured: &[f64], noise: f64, dt_s: f64, simulated: &mut [f64]) {
        let (a, f) = (self.a, self.f_hz);
        let window = ((WINDOW_S / dt_s) as usize).max(8);
        for (block, values) in simulated.chunks_mut(window).enumerate() {
            let first = block * window;
            let measured = &measured[first..first + values.len()];
            let wave = |i: usize| {
                let turns = f * dt_s * (first + i) as f64;
                let angle = TAU * (turns - libm::floor(turns));
                (libm::cos(angle), libm::sin(angle))
            };
            let (mut cc, mut cs, mut ss, mut rc, mut rs) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (i, (m, v)) in measured.iter().zip(values.iter()).enumerate() {
                let (c, s) = wave(i);
                let r = m - v;
                cc += c * c;
                cs += c * s;
                ss += s * s;
                rc += r * c;
                rs += r * s;
            }
            // Both quadratures are normal with variance a^2/2 before the record is seen.
            let ridge = noise * noise / (0.5 * a * a + 1e-18);
            let (cc, ss) = (cc + ridge, ss + ridge);
            let determinant = cc * ss - cs * cs;
            let (mut p, mut q) =
                ((rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant);
            let size = libm::sqrt(p * p + q * q);
            if size > 1.5 * a {
                (p, q) = (p * 1.5 * a / size, q * 1.5 * a / size);
            }
            for (i, (m, v)) in measured.iter().zip(values.iter_mut()).enumerate() {
                let (c, s) = wave(i);
                let hum = p * c + q * s;
                // As if the sample itself had not been used to find the phase: no noise is explained away.
                let leverage = (ss * c * c - 2.0 * cs * c * s + cc * s * s) / determinant;
                *v = m - (m - (*v + hum)) / (1.0 - leverage.min(0.5));
            }
        }
    }
}
