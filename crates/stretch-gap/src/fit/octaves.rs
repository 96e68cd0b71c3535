//! Mean squares of a residual by octaves of time. They separate a real rise from chance, whatever
//! the residual's colour.
//!
//! A mean square over all frequencies is dominated by the high ones, because there are most of
//! them. A slow regressor that removes 5 % of slow noise is then credited with several nats where
//! chance gives half a nat. Therefore a residual is transformed by the orthonormal Haar transform
//! (Mallat 1989, doi 10.1109/34.192463): neighbours a, b give (a - b)/sqrt 2, the detail of this
//! octave, and (a + b)/sqrt 2, which is passed to the next octave. Coefficients of a stationary
//! process are nearly independent, with one variance per octave (Whittle 1953, doi
//! 10.1007/BF02590998, for frequencies). With the variances of all octaves profiled out, two
//! hypotheses differ in their Gaussian log-likelihoods, determinants included, by
//!
//! ```text
//! S = sum over octaves j of (m_j/2) ln(P_j/P'_j),     m_j = n_j/(1 + u^2 n_j)
//! ```
//!
//! with n_j coefficients of mean squares P_j and P'_j, and the share u to which the noise is known.
//! A regressor that does nothing yields at most half a nat on average, in noise of any colour. An
//! effect that acts between trials is seen once per trial, because its octave has as many
//! coefficients.
//!
//! This shows whether an effect is more than chance. It does not show which cause is larger,
//! because slow power of any size may be slow noise. Therefore causes are ranked by their
//! [score](crate::fit::score).

use std::f64::consts::FRAC_1_SQRT_2;

use crate::numerics::linear::dot;

/// Octaves: the last holds all that is slower than 2^10 samples, ten seconds at 100 Hz.
const OCTAVES: usize = 11;
/// Smallest mean square, in variances of the noise: noise may be predicted too large, but no model
/// is exact.
const LEAST: f64 = 0.05;

/// Share to which the noise of an octave is known, whatever the number of its coefficients, because
/// no recorder's noise is exactly as described.
const KNOWN: f64 = 0.03;

/// Sums of squares by octave, and how many coefficients make each.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Octaves {
    sums: [f64; OCTAVES],
    counts: [f64; OCTAVES],
}

impl Octaves {
    /// Adds a stretch without a break: the squares of `clean`, the residual r minus its most likely
    /// nuisances N a. These nuisances cost the second part of r'V^-1 r = |r - N a|^2 + a'D^-1 a,
    /// with their variances D. This part is added once per stretch, in the last octave, because
    /// products of r and r - N a by octave have the same sum, but may be negative.
    pub(crate) fn add(&mut self, residual: &[f64], clean: &[f64]) {
        for (octave, x) in coefficients(clean).iter().enumerate() {
            self.sums[octave] += dot(x, x);
            self.counts[octave] += x.len() as f64;
        }
        self.sums[OCTAVES - 1] += (dot(residual, clean) - dot(clean, clean)).max(0.0);
    }

    /// Mean squares at equal transmitted noise: `own` is the noise that the hypothesis transmits,
    /// `larger` the factor for noise that it does not transmit. At least a tenth is kept.
    pub(crate) fn at_equal_noise(mut self, nominal: &Self, own: &Self, larger: f64) -> Self {
        for ((x, nominal), own) in self.sums.iter_mut().zip(nominal.sums).zip(own.sums) {
            let known = if nominal > own { larger } else { 1.0 };
            *x = (*x + known * (nominal - own)).max(0.1 * *x);
        }
        self
    }

    /// Adds the difference of another residual's squares, `to` minus `from`; at least a tenth is
    /// kept.
    pub(crate) fn moved(mut self, from: &Self, to: &Self) -> Self {
        for ((x, from), to) in self.sums.iter_mut().zip(from.sums).zip(to.sums) {
            *x = (*x + to - from).max(0.1 * *x);
        }
        self
    }

    /// Mean squares that are `share` times as large.
    pub(crate) fn scaled(mut self, share: f64) -> Self {
        self.sums.iter_mut().for_each(|sum| *sum *= share);
        self
    }

    /// Sums of squares of both, which are independent.
    pub(crate) fn plus(mut self, other: &Self) -> Self {
        self.sums.iter_mut().zip(other.sums).for_each(|(x, y)| *x += y);
        self
    }

    /// Mean squares without possible model discrepancy: in each octave the share `of_closed` of
    /// what was closed of the `nominal` there, as far as `next` leaves less.
    pub(crate) fn less_discrepancy(mut self, nominal: &Self, next: &Self, of_closed: f64) -> Self {
        for ((x, nominal), next) in self.sums.iter_mut().zip(nominal.sums).zip(next.sums) {
            let may_be_left = of_closed * (nominal - *x).max(0.0);
            *x = (*x - may_be_left).max(next).min(*x);
        }
        self
    }

    /// Mean squares of noise as described, with as many coefficients.
    pub(crate) fn of_noise(&self) -> Self {
        Self { sums: self.counts, counts: self.counts }
    }

    /// S of the module's head, from this one to the next.
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

/// Haar's coefficients by octave. A last sample without a neighbour is passed on unchanged, and the
/// last octave holds the rest.
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

    /// An Ornstein-Uhlenbeck process of variance 1.
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

    /// If nothing was closed, the rest is no discrepancy. If much was closed, a small further
    /// improvement is not credited to a further effect.
    #[test]
    fn discrepancy_is_a_share_of_what_was_closed_in_its_octave() {
        let of = |slow: f64, quick: f64| {
            let mut octaves = Octaves { sums: [100.0; OCTAVES], counts: [100.0; OCTAVES] };
            (octaves.sums[9], octaves.sums[1]) = (100.0 * slow, 100.0 * quick);
            octaves
        };
        let nominal = of(401.0, 5.0);
        let rise =
            |base: Octaves, next: Octaves| base.less_discrepancy(&nominal, &next, 0.03).rise(&next);
        let (base, next) = (of(9.0, 5.0), of(1.0, 1.0));
        // of 392 closed slowly 11.8 may be left; nothing was closed of the quick part
        approx::assert_relative_eq!(
            rise(base, next),
            of(1.0, 5.0).rise(&next),
            max_relative = FIT_WELL
        );
        assert!(rise(of(20.0, 1.0), next) > 12.0);
        // what a further effect makes worse counts in full, and without a first effect there is no
        // discrepancy
        assert_eq!(rise(next, base), next.rise(&base));
        assert_eq!(rise(nominal, next), nominal.rise(&next));
        assert_eq!(base.less_discrepancy(&nominal, &next, 0.0), base);
    }

    /// For a regressor without effect, chance yields chi^2/2 nats with one degree of freedom: 0.5
    /// on average, above 12 nats once in 10^6. This holds in white noise, also with additional slow
    /// power.
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
                    // Fitted as in a real fit, in the metric of white noise.
                    let size = dot(&d, &noise) / dot(&d, &d);
                    let left: Vec<f64> = noise.iter().zip(&d).map(|(r, d)| r - size * d).collect();
                    rises.push(of(&noise).rise(&of(&left)));
                }
                let mean = rises.iter().sum::<f64>() / DRAWS as f64;
                let most = rises.iter().copied().fold(0.0, f64::max);
                let told = format!("{share} of {memory}, regressor {regressor}: {mean}, {most}");
                // 200 draws determine the mean to 0.05; a fit for white noise gains less in
                // coloured noise.
                assert!((-0.5..0.7).contains(&mean) && most < 12.0, "{told}");
            }
        }
    }
}
