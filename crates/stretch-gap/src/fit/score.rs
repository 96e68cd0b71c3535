//! Statistics of a residual: reduced chi-square, effective sample size, and the score of one
//! hypothesis against another.
//!
//! Residuals r are in multiples of the noise, without nuisances. Their mean square is the *reduced
//! chi-square*
//!
//! ```text
//! X = (1/N) sum r_i^2,     excess = X - 1
//! ```
//!
//! X is 1 if only noise is left; the *excess* is the model's error, in units of the noise's
//! variance. Neighbouring residuals are correlated, so N samples count only as the *effective
//! sample size* N/m, where the integral time of the squares is (Bartlett 1946, doi 10.2307/2983611)
//!
//! ```text
//! m = 1 + 2 sum_k rho_k^2
//! ```
//!
//! With the noise's variance profiled out, the Gaussian log-likelihood of N/m observations is
//! -(N/2m) ln X. Two hypotheses differ in it by
//!
//! ```text
//! S = sum over stages of (N/2m) ln(X_nominal/X) - (k/2) ln(blocks)
//! ```
//!
//! with Schwarz's penalty for k free parameters (1978, doi 10.1214/aos/1176344136), counted in blocks. Held-out samples
//! enter with their own N and X and need no penalty.

use crate::{
    fit::{
        alike::{Read, taken},
        octaves::Octaves,
    },
    numerics::linear::dot,
};

/// Mean squares of one stage in variances of its noise: the reduced chi-square over fitted and over held-out samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Misfit {
    pub(crate) stage: usize,
    pub(crate) fit: f64,
    pub(crate) held: f64,
    /// Mean squares of fitted and held-out samples together, by octaves.
    pub(crate) octaves: Octaves,
    /// The residual, if an effect of the catalogue reads this output or this output reads others:
    /// see [`crate::fit::alike`].
    pub(crate) read: Option<Read>,
}

/// Effective numbers N/m of the samples of one stage: fitted, held out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observations {
    pub(crate) fit: f64,
    pub(crate) held: f64,
}

/// Rise of a likelihood, or reduction of a cost, that justifies repeating the search, nats: the
/// penalty of a parameter.
pub(crate) const LEARNT: f64 = 5.0;
/// Share by which the noise of an input may exceed its estimate, because a robust deviation
/// underestimates heavy tails.
const LARGER: f64 = 0.5;
/// Smallest share of a mean square that is kept when noise is subtracted from it.
const LEAST_KEPT: f64 = 0.1;

/// Returns the excess, the reduced chi-square minus one. It is defined only here.
pub(crate) fn excess(reduced_chi_square: f64) -> f64 {
    reduced_chi_square - 1.0
}

/// Returns the gap: the excess, but 0 if the residual is below the noise by chance.
pub(crate) fn gap(reduced_chi_square: f64) -> f64 {
    excess(reduced_chi_square).max(0.0)
}

/// Mean of the blocks' mean squares; 1, which is no excess, without blocks.
pub(crate) fn mean_square(blocks: &[f64]) -> f64 {
    if blocks.is_empty() { 1.0 } else { blocks.iter().sum::<f64>() / blocks.len() as f64 }
}

impl Misfit {
    /// Returns this misfit, at equal transmitted noise, plus the change of its residual's misfit
    /// from `from` to `to`.
    pub(crate) fn moved(&self, from: &Self, to: &Self) -> Self {
        let moved = |x: f64, from: f64, to: f64| (x + to - from).max(LEAST_KEPT * x);
        Self {
            fit: moved(self.fit, from.fit, to.fit),
            held: moved(self.held, from.held, to.held),
            octaves: self.octaves.moved(&from.octaves, &to.octaves),
            read: self.read.clone(),
            stage: self.stage,
        }
    }

    /// Misfit of a hypothesis against the re-tuned nominal simulator, each with the noise of the
    /// *measured input* that it transmits.
    ///
    /// X includes the input noise that arrives at the output. A slow amplifier or a slipping sleeve
    /// transmits less of it, and would win for any noisy input, whether it exists or not. Therefore
    /// hypotheses are compared at equal transmitted noise: X + k (T_nominal - T), where T is the
    /// transmitted noise, in multiples of the noise. T is known only to a factor, and a gap may be
    /// noise that is larger than estimated. Therefore, if less is transmitted, k is the factor on
    /// the noise that would explain the nominal simulator's gap, at most 1 + [`LARGER`]; otherwise
    /// k is 1.
    pub(crate) fn at_equal_noise(&self, nominal: &Self, own: &Self, gap: f64) -> Self {
        let larger = 1.0 + (gap / nominal.fit.max(f64::MIN_POSITIVE)).min(LARGER);
        // If the noise is overestimated, more could be subtracted than there is.
        let level = |x: f64, nominal: f64, own: f64| {
            let known = if nominal > own { larger } else { 1.0 };
            (x + known * (nominal - own)).max(LEAST_KEPT * x)
        };
        Self {
            fit: level(self.fit, nominal.fit, own.fit),
            held: level(self.held, nominal.held, own.held),
            octaves: self.octaves.at_equal_noise(&nominal.octaves, &own.octaves, larger),
            read: self.read.clone(),
            stage: self.stage,
        }
    }
}

/// Samples of a residual that count as one observation of its mean square: m of the module's head, at most a block.
///
/// `parts` are stretches without a break; correlations are summed up to two blocks.
pub(crate) fn samples_per_observation(parts: &[&[f64]], block: usize) -> f64 {
    let product = |lag: usize| -> f64 {
        let long = parts.iter().filter(|p| p.len() > lag);
        long.map(|p| dot(&p[lag..], &p[..p.len() - lag])).sum()
    };
    let power = product(0).max(1e-300);
    let sum: f64 = (1..=2 * block).map(|lag| (product(lag) / power).powi(2)).sum();
    (1.0 + 2.0 * sum).min(block as f64)
}

/// S of the module's head, before the priors of forms.
pub(crate) fn score(
    nominal: &[Misfit],
    misfits: &[Misfit],
    observations: &[Observations],
    free: usize,
    blocks: f64,
) -> f64 {
    let mut sum = -0.5 * free as f64 * blocks.ln();
    for (a, b) in nominal.iter().zip(misfits) {
        let n = &observations[a.stage];
        sum += 0.5 * n.fit * (a.fit / b.fit).ln() + 0.5 * n.held * (a.held / b.held).ln();
    }
    sum
}

/// Returns the correction of a score for what effects explain by errors that outputs
/// [share](crate::fit::alike), nats, to be added; `observations` by stage.
pub(crate) fn shared(misfits: &[Misfit], observations: &[Observations]) -> f64 {
    let read = misfits.iter().filter_map(|m| {
        let Observations { fit, held } = observations[m.stage];
        Some((m.read.as_ref()?, [fit, held]))
    });
    taken(&read.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::RandomGenerator;
    use testkit::tolerance::{EFFECTIVE_SIZE, F64_ROUNDING};

    #[test]
    fn samples_count_as_far_as_they_are_alike() {
        let mut random = RandomGenerator::new(4, 0);
        let white: Vec<f64> = (0..40_000).map(|_| random.gauss()).collect();
        let kept = 0.8_f64;
        let mut x = 0.0;
        let red: Vec<f64> = white
            .iter()
            .map(|w| {
                x = kept * x + w;
                x
            })
            .collect();
        // Of a first-order process 1 + 2 sum rho^2k = (1 + rho^2)/(1 - rho^2); 100 chance correlations of 1/40 000 each add.
        let theory = (1.0 + kept * kept) / (1.0 - kept * kept);
        let found = samples_per_observation(&[&red], 50);
        approx::assert_relative_eq!(found, theory, epsilon = 0.0, max_relative = EFFECTIVE_SIZE);
        let found = samples_per_observation(&[&white], 50);
        approx::assert_relative_eq!(found, 1.0, epsilon = 0.0, max_relative = EFFECTIVE_SIZE);
    }

    #[test]
    fn what_is_transmitted_less_is_no_better_fit() {
        let of = |x: f64| Misfit { fit: x, held: x, ..Misfit::default() };
        let level = |gap| of(1.2).at_equal_noise(&of(0.5), &of(0.2), gap).fit;
        approx::assert_relative_eq!(level(0.0), 1.5, max_relative = F64_ROUNDING);
        // A gap of a tenth could be noise that is a fifth larger; a gap of ten variances of the
        // noise could not.
        approx::assert_relative_eq!(level(0.1), 1.56, max_relative = F64_ROUNDING);
        approx::assert_relative_eq!(level(10.0), 1.65, max_relative = F64_ROUNDING);
        // A hypothesis that transmits more gains nothing from this.
        assert_eq!(of(1.0).at_equal_noise(&of(0.0), &of(5.0), 9.0).held, LEAST_KEPT);
    }
}
