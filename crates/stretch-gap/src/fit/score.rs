//! Computes statistics of a residual: reduced chi-square, effective sample size, and the score of
//! one hypothesis relative to another.
//!
//! Residuals r are in multiples of the noise, without nuisances. Their mean square is the *reduced
//! chi-square*
//!
//! ```text
//! X = (1/N) sum r_i^2,     excess = X - 1
//! ```
//!
//! X is 1 if only noise is left; the *excess* is the mean square of the model's error, in units of
//! the noise's variance. Neighbouring residuals are correlated, so N samples count only as N/m
//! observations, the *effective sample size*. With the autocorrelation rho_k at lag k, m is the
//! integral time of the squared residual (Bartlett 1946, doi 10.2307/2983611):
//!
//! ```text
//! m = 1 + 2 sum_k rho_k^2
//! ```
//!
//! If the noise's variance is profiled out (replaced by its most likely value), the Gaussian
//! log-likelihood of N/m observations is -(N/2m) ln X. The score S of a hypothesis is its
//! log-likelihood relative to that of the re-tuned nominal simulator, with a penalty:
//!
//! ```text
//! S = sum over stages of (N/2m) ln(X_nominal/X) - (k/2) ln(blocks)
//! ```
//!
//! The penalty for k free parameters is that of Schwarz (1978, doi 10.1214/aos/1176344136), with
//! the number of blocks as the number of observations. Held-out samples are a second sum with their
//! own N and X, and need no penalty.

use crate::{
    fit::{
        alike::{Read, taken},
        octaves::Octaves,
    },
    numerics::linear::dot,
};

/// Mean squares of one stage's residual in variances of its noise: the reduced chi-squares over
/// fitted and over held-out samples.
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

/// Effective sample sizes N/m of one stage: of its fitted and of its held-out samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observations {
    pub(crate) fit: f64,
    pub(crate) held: f64,
}

/// Smallest rise of a log-likelihood, or reduction of a cost, that justifies repeating the search,
/// nats. It is about the penalty of one parameter.
pub(crate) const LEARNT: f64 = 5.0;
/// Share by which the noise of an input may exceed its estimate, because a robust estimate of the
/// standard deviation is too small if the noise has heavy tails.
const LARGER: f64 = 0.5;
/// Smallest share of a mean square that is kept when noise is subtracted from it.
const LEAST_KEPT: f64 = 0.1;

/// Returns the excess, the reduced chi-square minus one. This is the only place that defines it.
pub(crate) fn excess(reduced_chi_square: f64) -> f64 {
    reduced_chi_square - 1.0
}

/// Returns the gap: the excess, or 0 if the residual is by chance below the noise.
pub(crate) fn gap(reduced_chi_square: f64) -> f64 {
    excess(reduced_chi_square).max(0.0)
}

/// Returns the mean of the blocks' mean squares. Without blocks it is 1, which is no excess.
pub(crate) fn mean_square(blocks: &[f64]) -> f64 {
    if blocks.is_empty() { 1.0 } else { blocks.iter().sum::<f64>() / blocks.len() as f64 }
}

impl Misfit {
    /// Returns this misfit plus the difference `to` - `from`. This misfit is corrected to equal
    /// transmitted noise; `from` and `to` are misfits of the uncorrected residual before and after
    /// a change.
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

    /// Returns the misfit of a hypothesis, corrected such that it can be compared with that of the
    /// re-tuned nominal simulator. `nominal` and `own` are the noise of the *measured input* that
    /// the nominal simulator and the hypothesis transmit to the output.
    ///
    /// X includes the input noise that arrives at the output. A hypothesis with a slow amplifier or
    /// a slipping sleeve transmits less of this noise, and would win for any noisy input, whether
    /// the effect exists or not. Therefore hypotheses are compared at equal transmitted noise: X +
    /// k (T_nominal - T), where T is the transmitted noise, in variances of the noise. T is known
    /// only approximately, and a gap may be input noise that is larger than estimated. If the
    /// transmitted noise were larger by the factor k = 1 + gap/T_nominal, it would explain the
    /// nominal simulator's gap completely. This k, limited to 1 + [`LARGER`], is used if T is less
    /// than T_nominal; otherwise k is 1.
    pub(crate) fn at_equal_noise(&self, nominal: &Self, own: &Self, gap: f64) -> Self {
        let larger = 1.0 + (gap / nominal.fit.max(f64::MIN_POSITIVE)).min(LARGER);
        // If the noise is overestimated, the difference could be larger than the mean square.
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

/// Returns how many samples of a residual count as one observation of its mean square: m of the
/// module documentation, at most a block.
///
/// `parts` are stretches of samples without a break. Autocorrelations are summed up to a lag of two
/// blocks.
pub(crate) fn samples_per_observation(parts: &[&[f64]], block: usize) -> f64 {
    let product = |lag: usize| -> f64 {
        let long = parts.iter().filter(|p| p.len() > lag);
        long.map(|p| dot(&p[lag..], &p[..p.len() - lag])).sum()
    };
    let power = product(0).max(1e-300);
    let sum: f64 = (1..=2 * block).map(|lag| (product(lag) / power).powi(2)).sum();
    (1.0 + 2.0 * sum).min(block as f64)
}

/// Returns the score S of the module documentation. It does not contain the priors of the effects' forms.
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

/// Returns a correction that has to be added to a score, nats: explaining one output's error by
/// [an error in common](crate::fit::alike) with another output must not count. `observations` holds
/// the effective sample sizes by stage.
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
        // For a first-order process, 1 + 2 sum rho^2k = (1 + rho^2)/(1 - rho^2). The squares of 100
        // correlations by chance add 1/40 000 each.
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
        // A gap of 0.1 may be input noise that is a fifth larger than estimated. A gap of ten
        // variances of the noise is too large for this.
        approx::assert_relative_eq!(level(0.1), 1.56, max_relative = F64_ROUNDING);
        approx::assert_relative_eq!(level(10.0), 1.65, max_relative = F64_ROUNDING);
        // A hypothesis that transmits more gains nothing from the factor.
        assert_eq!(of(1.0).at_equal_noise(&of(0.0), &of(5.0), 9.0).held, LEAST_KEPT);
    }
}
