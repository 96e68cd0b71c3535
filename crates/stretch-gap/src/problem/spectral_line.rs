//! A spectral line of known amplitude and unknown phase, judged by its power on samples where
//! nothing may be fitted.
//!
//! A model that contains a hum of amplitude a predicts the power of its line, but not its phase. In
//! each second the residual r, in multiples of the noise s, then has the covariance
//!
//! ```text
//! V = I + C C',     C = (a/sqrt 2) (cos(2 pi f t_i)/s_i, sin(2 pi f t_i)/s_i)
//! ```
//!
//! Both quadratures are normal with the variance a^2/2. The residual is whitened to V^-1/2 r with
//! the symmetric square root of V. Nothing is fitted to the residual. After whitening, the mean
//! square is 1 if the line is as strong as predicted, and larger if it is stronger. Components
//! outside the line do not change.

use std::f64::consts::TAU;

/// A sine of known frequency and amplitude and unknown phase.
///
/// ```
/// use stretch_gap::Line;
/// // A line of ten times the noise at 60 Hz, one second at 100 Hz: of a mean square of 50 that of the noise is left.
/// let turn = std::f64::consts::TAU * 60.0 * 0.01;
/// let mut residual: Vec<f64> = (0..100).map(|i| 10.0 * (turn * i as f64 + 0.3).sin()).collect();
/// let line = Line { hertz: 60.0, amplitude: 10.0 };
/// line.level(&mut residual, &[1.0; 100], 0.01);
/// let left: f64 = residual.iter().map(|r| r * r).sum();
/// assert!((left - 2.0).abs() < 0.1); // both quadratures at their own noise
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency, Hz.
    pub hertz: f64,
    /// Amplitude, in the unit of the output.
    pub amplitude: f64,
}

/// Time over which the phase is assumed constant, s.
const STEADY_S: f64 = 1.0;

impl Line {
    /// Whitens a residual in place. The residual is in multiples of the noise and has no gaps.
    /// `noise` is one standard deviation at every sample in the unit of the output, and `dt_s` the
    /// sample time, s.
    pub fn level(&self, residual: &mut [f64], noise: &[f64], dt_s: f64) {
        let window = ((STEADY_S / dt_s) as usize).max(8);
        for (r, sd) in residual.chunks_mut(window).zip(noise.chunks(window)) {
            let columns = self.columns(sd, dt_s);
            for (axis, variance) in principal(&columns) {
                // The covariance V has the variance 1 + lambda along an axis u.
                let along: f64 = axis.iter().zip(&*r).map(|(u, r)| u * r).sum();
                let change = (1.0 / (1.0 + variance).sqrt() - 1.0) * along;
                r.iter_mut().zip(&axis).for_each(|(r, u)| *r += change * u);
            }
        }
    }

    /// Returns C of the module's description.
    fn columns(&self, sd: &[f64], dt_s: f64) -> [Vec<f64>; 2] {
        [0.0, 0.25].map(|quarter| {
            let wave = |i: usize| {
                let turns = self.hertz * dt_s * i as f64 + quarter;
                libm::cos(TAU * (turns - turns.floor()))
            };
            let size = self.amplitude * std::f64::consts::FRAC_1_SQRT_2;
            sd.iter().enumerate().map(|(i, sd)| size * wave(i) / sd).collect()
        })
    }
}

/// Returns the axes of C C' and the variance along each: the eigenvectors of the 2 x 2 matrix C'C,
/// mapped by C.
fn principal([c, s]: &[Vec<f64>; 2]) -> Vec<(Vec<f64>, f64)> {
    let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(a, b)| a * b).sum::<f64>();
    let (cc, cs, ss) = (product(c, c), product(c, s), product(s, s));
    let half = 0.5 * libm::atan2(2.0 * cs, cc - ss);
    let (sin, cos) = (libm::sin(half), libm::cos(half));
    [(cos, sin), (-sin, cos)]
        .into_iter()
        .filter_map(|(p, q)| {
            let variance = p * p * cc + 2.0 * p * q * cs + q * q * ss;
            // At half the sample rate there is only one quadrature.
            (variance > 1e-9 * (cc + ss)).then(|| {
                let axis = c.iter().zip(s).map(|(c, s)| (p * c + q * s) / variance.sqrt());
                (axis.collect(), variance)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;
    use testkit::tolerance::MEDIAN_SPREAD;

    fn left(hertz: f64, amplitude: f64, predicted: f64) -> f64 {
        let mut random = RandomGenerator::new(3, 0);
        let mut sum = 0.0;
        let seconds = 200;
        for second in 0..seconds {
            let phase = TAU * f64::from(second) * 0.618;
            let wave = |i: usize| amplitude * libm::sin(TAU * hertz * 0.01 * i as f64 + phase);
            let mut r: Vec<f64> = (0..100).map(|i| wave(i) + random.gauss()).collect();
            Line { hertz, amplitude: predicted }.level(&mut r, &[1.0; 100], 0.01);
            sum += r.iter().map(|r| r * r).sum::<f64>() / 100.0;
        }
        sum / f64::from(seconds)
    }

    #[test]
    fn a_line_as_strong_as_predicted_is_no_gap_and_a_stronger_one_is() {
        // At 50 Hz and 100 samples per second, each second shows only one quadrature of the hum,
        // with a size that depends on the phase.
        for hertz in [50.0, 60.0] {
            approx::assert_relative_eq!(left(hertz, 5.0, 5.0), 1.0, max_relative = MEDIAN_SPREAD);
        }
        assert!(left(60.0, 50.0, 5.0) > 2.0);
        // If a line is predicted but absent, whitening reduces only the two of a hundred components
        // that belong to the line.
        assert!(left(60.0, 0.0, 50.0) > 0.95);
    }

    #[test]
    fn what_is_not_in_the_line_stays() {
        let slow: Vec<f64> = (0..300).map(|i| 4.0 * libm::sin(0.05 * f64::from(i))).collect();
        let mut levelled = slow.clone();
        Line { hertz: 60.0, amplitude: 20.0 }.level(&mut levelled, &[1.0; 300], 0.01);
        let power = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        approx::assert_relative_eq!(power(&levelled), power(&slow), max_relative = MEDIAN_SPREAD);
    }
}
