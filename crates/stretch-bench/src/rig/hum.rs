//! Mains hum whose phase wanders: as much of the residual at the line's frequency as an amplitude allows.

use std::f64::consts::TAU;

/// Window in which the phase is taken as steady, s.
const WINDOW_S: f64 = 1.0;

/// Adds to a simulated trial the hum of amplitude `a` (V) at `f` (Hz) whose phase in each second is the one that
/// the measured record shows; noise of standard deviation `sd` shrinks what it cannot tell.
pub(crate) fn add(a: f64, f: f64, sd: f64, dt_s: f64, measured: &[f64], simulated: &mut [f64]) {
    let window = ((WINDOW_S / dt_s) as usize).max(8);
    for (block, values) in simulated.chunks_mut(window).enumerate() {
        let measured = &measured[block * window..block * window + values.len()];
        let wave = |i: usize| {
            let turns = f * dt_s * (block * window + i) as f64;
            let angle = TAU * (turns - turns.floor());
            (angle.cos(), angle.sin())
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
        let ridge = sd * sd / (0.5 * a * a + 1e-18);
        let (cc, ss) = (cc + ridge, ss + ridge);
        let determinant = cc * ss - cs * cs;
        let (mut p, mut q) = ((rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant);
        let size = (p * p + q * q).sqrt();
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
