//! Computes mean squares of a residual by octaves of time scale. With them, a real rise of the
//! likelihood can be distinguished from chance, whatever the spectrum (colour) of the residual is.
//!
//! A likelihood that depends only on the total mean square treats noise as white. If slow noise
//! dominates the residual, a slow regressor that removes 5 % of it by chance is credited with
//! several nats, although chance should give half a nat. Therefore a residual is transformed by the
//! orthonormal Haar transform (Mallat 1989, doi 10.1109/34.192463). Neighbours a and b give (a -
//! b)/sqrt 2, a coefficient of the first octave, and (a + b)/sqrt 2, which is passed on to the next
//! octave. The coefficients of a stationary process are nearly independent, with one variance per
//! octave (for frequencies: Whittle 1953, doi 10.1007/BF02590998). With the variances of all
//! octaves profiled out, two hypotheses differ in their Gaussian log-likelihoods, determinants
//! included, by
//!
//! ```text
//! S = sum over octaves j of (m_j/2) ln(P_j/P'_j),     m_j = n_j/(1 + u^2 n_j)
//! ```
//!
//! Octave j has n_j coefficients, with the mean square P_j under the first and P'_j under the
//! second hypothesis. u is the relative accuracy to which the noise is known. A regressor without
//! effect yields at most half a nat on average, in noise of any spectrum. An effect that changes
//! only from trial to trial counts as few observations, because the last octave has only a few
//! coefficients per trial.
//!
//! S shows whether an effect is more than chance. It is not used to rank causes, because slow power
//! of any size may be slow noise. Causes are ranked by their [score](crate::fit::score).

use std::f64::consts::FRAC_1_SQRT_2;

use crate::numerics::linear::dot;

/// Number of octaves. The last holds everything that is slower than 2^10 samples, ten seconds at
/// 100 Hz.
const OCTAVES: usize = 11;
/// Smallest mean square that is used, in variances of the noise. A smaller one would mean that the
/// noise was assumed too large, and would be credited to the model.
const LEAST: f64 = 0.05;

/// Relative accuracy u to which the noise of an octave is known. It does not depend on the number
/// of coefficients, because no recorder's noise is exactly as described.
const KNOWN: f64 = 0.03;

/// Sums of squares by octave, and the number of coefficients in each sum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Octaves {
    sums: [f64; OCTAVES],
    counts: [f64; OCTAVES],
}

impl Octaves {
    /// Adds a stretch of samples without a break. The squares are those of `clean`: the residual r
    /// minus its most likely nuisances N a, whose amplitudes a have the prior variances D. The
    /// quadratic form r'V^-1 r = |r - N a|^2 + a'D^-1 a has a second part, the cost of the
    /// nuisances. It is added once per stretch, to the last octave. The products of r and r - N a
    /// by octave would have the same sum, but might be negative.
    pub(crate) fn add(&mut self, residual: &[f64], clean: &[f64]) {
        for (octave, x) in coefficients(clean).iter().enumerate() {
            self.sums[octave] += dot(x, x);
            self.counts[octave] += x.len() as f64;
        }
        self.sums[OCTAVES - 1] += (dot(residual, clean) - dot(clean, clean)).max(0.0);
    }

    /// Returns the mean squares at
    /// [equal transmitted noise](crate::fit::score::Misfit::at_equal_noise). `own` is the noise
    /// that the hypothesis transmits; `larger` is the factor on noise that it does not transmit. At
    /// least a tenth of each mean square is kept.
    pub(crate) fn at_equal_noise(mut self, nominal: &Self, own: &Self, larger: f64) -> Self {
        for ((x, nominal), own) in self.sums.iter_mut().zip(nominal.sums).zip(own.sums) {
            let known = if nominal > own { larger } else { 1.0 };
            *x = (*x + known * (nominal - own)).max(0.1 * *x);
        }
        self
    }

    /// Adds the difference between the squares of two other residuals, `to` minus `from`. At least
    /// a tenth of each mean square is kept.
    pub(crate) fn moved(mut self, from: &Self, to: &Self) -> Self {
        for ((x, from), to) in self.sums.iter_mut().zip(from.sums).zip(to.sums) {
            *x = (*x + to - from).max(0.1 * *x);
        }
        self
    }

    /// Returns mean squares that are `share` times as large.
    pub(crate) fn scaled(mut self, share: f64) -> Self {
        self.sums.iter_mut().for_each(|sum| *sum *= share);
        self
    }

    /// Returns the sums of squares of the sum of two independent residuals.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.sums.iter_mut().zip(other.sums).for_each(|(x, y)| *x += y);
        self
    }

    /// Returns S of the module documentation, from this hypothesis to `next`.
    pub(crate) fn rise(&self, next: &Self) -> f64 {
        let mean = |sum: f64, count: f64| (sum / count).max(LEAST);
        let octaves = self.sums.iter().zip(next.sums).zip(self.counts);
        octaves
            .filter(|(_, count)| *count > 0.0)
            .map(|((p, q), count)| {
                let known = count / (1.0 + count * KNOWN * KNOWN);
                0.5 * known * (mean(*p, count) / mean(q, count)).ln()
            })
            .sum()
    }
}

/// Returns the Haar coefficients by octave. A last sample without a neighbour is passed on
/// unchanged to the next octave. The last octave holds what remains.
fn coefficients(values: &[f64]) -> [Vec<f64>; OCTAVES] {
    let mut left = values.to_vec();
    std::array::from_fn(|octave| {
        if octave + 1 == OCTAVES {
            return std::mem::take(&mut left);
        }
        let pairs = left.chunks_exact(2);
        let odd = pairs.remainder();
        let details = pairs.clone().map(|p| FRAC_1_SQRT_2 * (p[0] - p[1])).collect();
        let sums = pairs.map(|p| FRAC_1_SQRT_2 * (p[0] + p[1])).chain(odd.iter().copied());
        left = sums.collect();
        details
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::{linear::dot, random::RandomGenerator};
    use testkit::tolerance::FIT_WELL;

    fn of(values: &[f64]) -> Octaves {
        let mut octaves = Octaves::default();
        values.chunks(6000).for_each(|part| octaves.add(part, part));
        octaves
    }

    /// Returns an Ornstein-Uhlenbeck process of variance 1.
    fn slow(samples: usize, memory: f64, random: &mut RandomGenerator) -> Vec<f64> {
        let kept = (-1.0 / memory).exp();
        let mut x = random.gauss();
        let mut next = || {
            x = kept * x + (1.0 - kept * kept).sqrt() * random.gauss();
            x
        };
        (0..samples).map(|_| next()).collect()
    }

    #[test]
    fn the_transform_keeps_every_square() {
        let mut random = RandomGenerator::new(3, 0);
        for samples in [1, 2, 7, 4099] {
            let x: Vec<f64> = (0..samples).map(|_| random.gauss()).collect();
            let octaves = of(&x);
            let sum: f64 = octaves.sums.iter().sum();
            approx::assert_relative_eq!(sum, dot(&x, &x), max_relative = FIT_WELL);
            assert_eq!(octaves.counts.iter().sum::<f64>(), samples as f64);
        }
    }

    /// For a regressor without effect, chance yields chi^2/2 nats with one degree of freedom: 0.5
    /// nats on average, and more than 12 nats once in 10^6. This holds in white noise, also with
    /// additional slow power.
    #[test]
    fn a_regressor_that_does_nothing_rises_as_theory_says() {
        const DRAWS: usize = 200;
        for (share, memory) in [(0.0, 1.0), (0.05, 100.0), (0.05, 400.0), (0.5, 20.0)] {
            for regressor in [3.0, 50.0, 300.0] {
                let mut random = RandomGenerator::new(8, (10.0 * regressor + memory) as u64);
                let mut rises = Vec::with_capacity(DRAWS);
                for _ in 0..DRAWS {
                    let drift = slow(12_000, memory, &mut random);
                    let noise: Vec<f64> = drift
                        .iter()
                        .map(|w| f64::sqrt(share) * w + f64::sqrt(1.0 - share) * random.gauss())
                        .collect();
                    let d = slow(12_000, regressor, &mut random);
                    // The regressor is fitted as in a real fit, in the metric of white noise.
                    let size = dot(&d, &noise) / dot(&d, &d);
                    let left: Vec<f64> = noise.iter().zip(&d).map(|(r, d)| r - size * d).collect();
                    rises.push(of(&noise).rise(&of(&left)));
                }
                let mean = rises.iter().sum::<f64>() / DRAWS as f64;
                let most = rises.iter().copied().fold(0.0, f64::max);
                let told = format!("{share} of {memory}, regressor {regressor}: {mean}, {most}");
                // 200 draws determine the mean to 0.05. In coloured noise, a fit in the metric of
                // white noise gains less.
                assert!((-0.5..0.7).contains(&mean) && most < 12.0, "{told}");
            }
        }
    }
}
