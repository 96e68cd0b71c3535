//! Estimates the sizes and correlation times of a stage's nuisances (slow drift and offsets of
//! parameters, drift of the recorder) from the recording.
//!
//! For example, a supply may drift by 0.1 % or by 0.5 %, and within half a second or within thirty
//! seconds. A wrong assumption would be mistaken for an effect. Therefore the size a and
//! correlation time tau of every drift, and the size of every offset, maximise
//!
//! ```text
//! L = -(r'V^-1 r + ln det V)/2 + ln p(a, tau),     V = s I + C P^-1 C'
//! ```
//!
//! over the samples that are not test samples (Rasmussen and Williams 2006, section 5.4.1). V is
//! the covariance of the residual r, with the columns C and prior precisions P of
//! [`nuisance`](crate::fit::nuisance). The priors p are lognormal around the values in the
//! simulator's description, and wide. The factor s enlarges the noise, so that other parts of the
//! residual are not taken for a nuisance: see `Metric::spectral_level`. A recorder need not drift,
//! so a = 0 is also tried for its drift.

use rayon::prelude::*;

use crate::{
    fit::metric::{Level, Loose, Metric},
    problem::sample_roles::{Role, SampleRoles},
};

/// Sizes that are tried, as multiples of what the simulator describes.
const SIZES: [f64; 6] = [0.2, 0.4, 0.7, 1.0, 1.6, 2.5];
/// Sizes that are too large for a recorder's drift, because such a drift is smaller than the
/// recorder's noise. If one of these sizes fits best, the recorder is not the cause. No drift is
/// then assumed, so that the gap remains. A prior would not suffice, because it would only lower
/// the likelihood of a large drift.
const BEYOND: [f64; 5] = [3.2, 4.0, 6.4, 10.0, 16.0];
/// Correlation times that are tried, s.
const TIMES_S: [f64; 7] = [0.3, 0.7, 1.5, 3.0, 6.0, 12.0, 30.0];
/// Standard deviations of the priors of ln a and of ln tau: a factor of two, and of three.
const SPREAD: (f64, f64) = (0.7, 1.1);

impl Metric {
    /// Returns the metric whose nuisances have the most likely sizes and correlation times for a
    /// residual in multiples of the noise, and the rise of the log-likelihood compared with this
    /// metric, nats. If the residual depends on the motion, a missing effect is the likelier cause.
    /// The recorder is then assumed not to drift, and a parameter to drift as the simulator
    /// describes it.
    pub(crate) fn adapted(
        &self,
        roles: &SampleRoles,
        residual: &[f64],
        depends_on_motion: impl Fn(&[f64]) -> bool,
    ) -> (Self, f64) {
        let (mut best, mut gained) = (self.clone(), 0.0);
        for which in 0..self.loose().len() {
            let own = best.loose()[which].level;
            let one = |level| best.looked_at(|i, own| if i == which { level } else { own }, roles);
            let levels: Vec<Level> = hypotheses(&best.loose()[which]).chain([own]).collect();
            // A metric needs much memory. Therefore those of the levels are not kept.
            let first = levels.par_iter().map(|level| {
                let metric = one(*level);
                (metric.spectral_level(roles, residual), metric.beside(roles, residual, 1.0))
            });
            let first: Vec<(f64, f64)> = first.collect();
            let noise = first.iter().map(|(level, _)| *level).fold(f64::INFINITY, f64::min);
            let noise = noise.max(1.0).sqrt();
            let fit = |level: &Level| one(*level).beside(roles, residual, noise);
            let fits: Vec<f64> = match noise == 1.0 {
                true => first.into_iter().map(|(_, fit)| fit).collect(),
                false => levels.par_iter().map(fit).collect(),
            };
            let before = fits.last().copied().unwrap_or(0.0);
            let best_of = |fits: Vec<f64>, levels: &[Level]| {
                let all = fits.into_iter().zip(levels.to_vec());
                all.max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let Some((mut most, mut level)) = best_of(fits, &levels) else { continue };
            let beyond: Vec<Level> = beyond(&best.loose()[which]).collect();
            if SIZES.last() == Some(&level.size)
                && let Some(other) = best_of(beyond.par_iter().map(fit).collect(), &beyond)
                && other.0 > most
            {
                (most, level) = other;
            }
            let is_recorder = best.loose()[which].parameter.is_none();
            let usual = if is_recorder { Level::NONE } else { own };
            let set = |level| best.with(|i, own| if i == which { level } else { own }, roles);
            let is_of_motion = || {
                let mut left = residual.to_vec();
                one(Level::NONE).clean(roles, &mut left);
                depends_on_motion(&left)
            };
            if BEYOND.contains(&level.size) || (level != usual && is_of_motion()) {
                best = set(usual);
            } else {
                gained += most - before;
                best = set(level);
            }
        }
        (best, gained)
    }

    /// Returns the log-likelihood if the noise is `noise` times as large as assumed. To compare
    /// hypotheses, it is integrated over a and tau, because a residual that is likely only at a
    /// single level (a pair of a and tau) is weaker evidence than one that is likely at many
    /// levels:
    ///
    /// ```text
    /// ln E = l + sum over nuisances i of ln( sum_k p_k exp(l_k - l) / sum_k p_k )
    /// ```
    ///
    /// where l is L of the module documentation without ln p. For l_k, nuisance i has level k of
    /// the grid, and the others keep their levels; p_k is the prior of this level. The equation is
    /// exact for one nuisance, and treats several as independent.
    pub(crate) fn evidence(&self, roles: &SampleRoles, residual: &[f64], noise: f64) -> f64 {
        let own = self.likelihood_beside(roles, residual, noise);
        let one = |which: usize| {
            let loose = &self.loose()[which];
            let levels: Vec<Level> = hypotheses(loose).collect();
            if levels.is_empty() {
                return 0.0;
            }
            let fit = |&level: &Level| {
                let at = self.looked_at(|i, own| if i == which { level } else { own }, roles);
                at.likelihood_beside(roles, residual, noise) - own - cost(loose, level)
            };
            let fits: Vec<f64> = levels.par_iter().map(fit).collect();
            let prior = levels.iter().map(|level| -cost(loose, *level));
            log_sum_exp(fits) - log_sum_exp(prior)
        };
        own + (0..self.loose().len()).map(one).sum::<f64>()
    }

    /// Returns L of the module documentation if the noise is `noise` times as large as assumed.
    fn beside(&self, roles: &SampleRoles, residual: &[f64], noise: f64) -> f64 {
        let price: f64 = self.loose().iter().map(|loose| cost(loose, loose.level)).sum();
        self.likelihood_beside(roles, residual, noise) - price
    }

    /// Returns the log-likelihood if the noise is `noise` times as large as assumed. Equivalently,
    /// the nuisances and the residual are scaled by 1/`noise` while the noise stays the same.
    fn likelihood_beside(&self, roles: &SampleRoles, residual: &[f64], noise: f64) -> f64 {
        if noise == 1.0 {
            return self.likelihood(roles, residual);
        }
        let smaller = |_, level: Level| Level { size: level.size / noise, ..level };
        let scaled: Vec<f64> = residual.iter().map(|r| r / noise).collect();
        self.looked_at(smaller, roles).likelihood(roles, &scaled)
    }

    /// Returns -(r'V^-1 r + ln det V)/2 over the samples that are not test samples.
    fn likelihood(&self, roles: &SampleRoles, residual: &[f64]) -> f64 {
        let column = self.column(roles, residual.to_vec());
        let square = |role| self.product(roles, &column, &column, role);
        let ln_det = self.ln_det(roles, Role::Fit) + self.ln_det(roles, Role::Held);
        -0.5 * (square(Role::Fit) + square(Role::Held) + ln_det)
    }

    /// Returns the spectral level of a residual at the rate of the blocks: the mean square of block
    /// means times the number of samples in a block. White noise of variance 1 has the level 1. The
    /// factor s of the module documentation is the smallest spectral level over all levels of the
    /// nuisances that are tried, but at least 1.
    pub(crate) fn spectral_level(&self, roles: &SampleRoles, residual: &[f64]) -> f64 {
        let mut clean = residual.to_vec();
        self.clean(roles, &mut clean);
        let looked = roles.looked_at().filter(|s| s.to <= clean.len());
        let blocks = looked.flat_map(|s| clean[s.from..s.to].chunks_exact(roles.block));
        let means = blocks.map(|b| b.iter().sum::<f64>() / b.len() as f64);
        let (count, sum) = means.fold((0.0, 0.0), |(n, sum), mean| (n + 1.0, sum + mean * mean));
        roles.block as f64 * sum / f64::max(count, 1.0)
    }
}

/// Returns the levels that a nuisance may have. For a recorder, no drift is one of them.
fn hypotheses(loose: &Loose) -> impl Iterator<Item = Level> {
    let times_s: Vec<f64> = match loose.drift {
        _ if loose.is_by_tick => Vec::new(),
        Some(_) => TIMES_S.into(),
        None => vec![loose.level.time_s],
    };
    loose.parameter.is_none().then_some(Level::NONE).into_iter().chain(levels(times_s, SIZES))
}

/// Returns the levels that are too large for a recorder.
fn beyond(loose: &Loose) -> impl Iterator<Item = Level> {
    loose.parameter.is_none().then(|| levels(TIMES_S.into(), BEYOND)).into_iter().flatten()
}

fn levels<const N: usize>(times_s: Vec<f64>, sizes: [f64; N]) -> impl Iterator<Item = Level> {
    times_s.into_iter().flat_map(move |time_s| sizes.map(|size| Level { size, time_s }))
}

/// Returns -ln p of a level; 0 for a nuisance of size 0.
fn cost(loose: &Loose, Level { size, time_s }: Level) -> f64 {
    if size == 0.0 {
        return 0.0;
    }
    let usual_s = loose.drift.map_or(time_s, |w| w.correlation_s);
    0.5 * (size.ln() / SPREAD.0).powi(2) + 0.5 * ((time_s / usual_s).ln() / SPREAD.1).powi(2)
}

/// Returns ln sum exp x without overflow.
fn log_sum_exp(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    most + values.iter().map(|x| (x - most).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        fit::noise_level::NoiseLevel, numerics::random::RandomGenerator,
        problem::sample_roles::Segment,
    };

    /// Returns a residual of noise and a drift, with a sensitivity to the drift that changes in
    /// time.
    fn residual(size: f64, time_s: f64, drive: &[f64]) -> Vec<f64> {
        let mut random = RandomGenerator::new(12, (100.0 * time_s) as u64);
        let kept = (-0.01 / time_s).exp();
        let mut drift = random.gauss();
        let one = |drive: &f64| {
            drift = kept * drift + (1.0 - kept * kept).sqrt() * random.gauss();
            size * drive * drift + random.gauss()
        };
        drive.iter().map(one).collect()
    }

    #[test]
    fn size_and_time_of_a_slow_drift_are_found_again() {
        let samples = 20_000;
        let drive: Vec<f64> = (0..samples).map(|i| 2.0 + (0.003 * i as f64).sin()).collect();
        let noise = NoiseLevel {
            sd: vec![1.0; samples],
            rms: 1.0,
            source: String::new(),
            known_to: 0.0,
            isolated: 0,
        };
        let roles = SampleRoles {
            segments: vec![Segment { trial: 0, from: 0, to: samples, role: Role::Fit }],
            block: 50,
            fit_trials: 1,
            borrowed_test: false,
        };
        let described = crate::problem::spec::SlowDrift { sd: 1.0, correlation_s: 4.0 };
        let metric = Metric::with_drift(noise, drive.clone(), described, &roles, 0.01);
        for (size, time_s) in [(0.4, 0.7), (1.6, 3.0), (1.0, 12.0)] {
            let record = residual(size, time_s, &drive);
            let (adapted, gained) = metric.adapted(&roles, &record, |_| false);
            let Level { size: found, time_s: found_s } = adapted.loose()[0].level;
            // The result may be at most one step of the grid away from the truth.
            assert!((0.55..1.8).contains(&(found / size)), "{found} for {size}");
            assert!((0.4..2.6).contains(&(found_s / time_s)), "{found_s} for {time_s}");
            assert!(gained >= 0.0);
        }
        // The integral is smaller than the maximum of the likelihood, but at least this maximum
        // times the prior probability of its level.
        let record = residual(1.0, 3.0, &drive);
        let (best, _) = metric.adapted(&roles, &record, |_| false);
        let evidence = best.evidence(&roles, &record, 1.0);
        let most = best.likelihood(&roles, &record);
        let count = (SIZES.len() * TIMES_S.len()) as f64;
        assert!(evidence < most, "{evidence} {most}");
        assert!(
            evidence > most - cost(&best.loose()[0], best.loose()[0].level) - count.ln(),
            "{evidence} {most}"
        );
        // The integral does not depend on the level at which the metric begins.
        let begun = metric.evidence(&roles, &record, 1.0);
        approx::assert_abs_diff_eq!(begun, evidence, epsilon = 1e-6);
        // If there is only noise, a small size is found, and adapting again gains nothing.
        let (quiet, _) = metric.adapted(&roles, &residual(0.0, 1.0, &drive), |_| false);
        assert!(quiet.loose()[0].level.size < 0.5);
        assert_eq!(quiet.adapted(&roles, &residual(0.0, 1.0, &drive), |_| false).1, 0.0);
    }
}
