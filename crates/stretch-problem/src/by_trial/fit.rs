//! A maximum a posteriori fit of some runs, by Levenberg-Marquardt.
//!
//! Minimises sum r^2 + sum x^2 over the numbers x, with residuals r in multiples of the noise. The normal matrix N = J'J + I has the
//! covariance N^-1; with errors that are left and that last, J'J counts 1/inflation of itself.

use nalgebra::{DMatrix, DVector};
use stretch_gap::{GapError, Model, Run, Simulator};

use super::{groups::Group, unknowns::Unknowns};

/// Most steps of a fit.
const STEPS: usize = 12;
/// Fall of the cost, as a share, below which a fit is over.
const DONE: f64 = 1e-6;
/// Most tries of a step.
const TRIES: usize = 6;

/// What is fitted to what.
pub(super) struct Target<'a> {
    pub(super) simulator: &'a dyn Simulator,
    pub(super) unknowns: &'a Unknowns,
    /// Noise by stage, one standard deviation.
    pub(super) noise: &'a [f64],
    /// Samples that are fitted.
    pub(super) group: &'a Group,
    pub(super) stop: &'a (dyn Fn() -> bool + Sync),
}

impl Target<'_> {
    /// Residuals of some numbers in multiples of the noise, stage after stage; what was not measured counts for nothing.
    fn residuals(&self, asked: &[Vec<f64>]) -> Vec<Result<Vec<f64>, GapError>> {
        let models: Vec<Model> = asked.iter().map(|x| self.unknowns.model(x)).collect();
        let stages = self.noise.len();
        let Group { samples, trials, .. } = self.group;
        let all: usize = self.simulator.trials()[..*trials].iter().map(|t| t.samples).sum();
        let runs: Vec<Run<'_>> = models
            .iter()
            .flat_map(|model| (0..stages).map(|s| Run::exact(s, model, *trials)))
            .collect();
        let mut outs = vec![vec![0.0; all]; runs.len()];
        let mut answers = self.simulated(&runs, &mut outs).into_iter();
        let is_lost = &self.simulator.record().is_lost;
        let mut outs = outs.into_iter();
        let one = |_: &Model| {
            let mut residual = Vec::with_capacity(stages * samples.len());
            let mut failed = None;
            for (stage, noise) in self.noise.iter().enumerate() {
                let (answer, out) = (answers.next(), outs.next().unwrap_or_default());
                failed = failed.or(answer.and_then(Result::err));
                let measured = self.simulator.measured(stage);
                residual.extend(samples.iter().map(|&i| {
                    let counts = !is_lost.get(i).copied().unwrap_or(false);
                    if counts { (measured[i] - out[i]) / noise } else { 0.0 }
                }));
            }
            failed.map_or(Ok(residual), Err)
        };
        models.iter().map(one).collect()
    }

    fn simulated(&self, runs: &[Run<'_>], outs: &mut [Vec<f64>]) -> Vec<Result<(), GapError>> {
        if (self.stop)() {
            return runs.iter().map(|_| Err(GapError::Stopped)).collect();
        }
        match self.simulator.batch() {
            Some(batch) => batch.simulate_many(runs, outs),
            None => {
                let pairs = runs.iter().zip(outs);
                pairs.map(|(run, out)| self.simulator.simulate(*run, out)).collect()
            }
        }
    }

    fn residual(&self, x: &[f64]) -> Result<Vec<f64>, GapError> {
        self.residuals(&[x.to_vec()]).pop().unwrap_or_else(|| Ok(Vec::new()))
    }

    /// Root mean square error of some numbers in multiples of the noise.
    pub(super) fn times_noise(&self, x: &[f64]) -> Result<f64, GapError> {
        Ok(mean_square(&self.residual(x)?).sqrt())
    }

    /// Sensitivities of the residuals by forward differences; a number whose step cannot be simulated has none.
    fn jacobian(&self, x: &[f64], residual: &[f64]) -> Result<DMatrix<f64>, GapError> {
        let steps: Vec<f64> = (0..x.len()).map(|i| self.unknowns.step(i, x)).collect();
        let moved = |i: usize| {
            let mut at = x.to_vec();
            at[i] += steps[i];
            at
        };
        let all: Vec<Vec<f64>> = (0..x.len()).map(moved).collect();
        let mut jacobian = DMatrix::zeros(residual.len(), x.len());
        for (i, there) in self.residuals(&all).into_iter().enumerate() {
            let there = match there {
                Ok(there) => there,
                Err(error @ (GapError::Stopped | GapError::Spent { .. })) => return Err(error),
                Err(_) => continue,
            };
            for (row, (a, b)) in there.iter().zip(residual).enumerate() {
                jacobian[(row, i)] = (a - b) / steps[i];
            }
        }
        Ok(jacobian)
    }
}

/// Where a fit ended.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    /// The numbers.
    pub(super) at: Vec<f64>,
    /// Root mean square error in multiples of the noise.
    pub(super) times_noise: f64,
    /// Covariance of the numbers, what was known before included.
    covariance: DMatrix<f64>,
    /// What the data say of each number, if all others were known.
    own: Vec<f64>,
}

impl Fit {
    pub(super) fn of(target: &Target<'_>, start: &[f64]) -> Result<Self, GapError> {
        let mut x = start.to_vec();
        target.unknowns.held(&mut x);
        let mut residual = target.residual(&x)?;
        let mut lambda = 1e-3;
        let mut jacobian = target.jacobian(&x, &residual)?;
        for _ in 0..STEPS {
            let cost = cost_of(&residual, &x);
            let Some((next, there)) = step(target, (&x, &residual, &jacobian), cost, &mut lambda)?
            else {
                break;
            };
            let fall = 1.0 - cost_of(&there, &next) / cost;
            (x, residual) = (next, there);
            jacobian = target.jacobian(&x, &residual)?;
            if fall < DONE {
                break;
            }
        }
        let stages = target.noise.len();
        let inflation = inflation(&residual, stages);
        let data = jacobian.tr_mul(&jacobian) / inflation;
        let own = data.diagonal().iter().copied().collect();
        let normal = data + DMatrix::identity(x.len(), x.len());
        let covariance = normal
            .cholesky()
            .map_or_else(|| DMatrix::identity(x.len(), x.len()), |factor| factor.inverse());
        Ok(Self { times_noise: mean_square(&residual).sqrt(), at: x, covariance, own })
    }

    /// Standard deviation of a number, in units of what was known before.
    pub(super) fn sd(&self, i: usize) -> f64 {
        self.covariance[(i, i)].max(0.0).sqrt()
    }

    /// What it would be if all others were known.
    pub(super) fn sd_alone(&self, i: usize) -> f64 {
        1.0 / (self.own[i] + 1.0).sqrt()
    }

    /// How alike the errors of two numbers are.
    pub(super) fn correlation(&self, i: usize, j: usize) -> f64 {
        self.covariance[(i, j)] / (self.sd(i) * self.sd(j)).max(f64::MIN_POSITIVE)
    }

    /// What the data alone say of a number: its value, and its variance; none where they say little.
    ///
    /// The posterior of a Gaussian prior N(0, 1) has 1/v = 1/v_data + 1 and m/v = x_data/v_data.
    pub(super) fn data(&self, i: usize) -> Option<(f64, f64)> {
        let v = self.covariance[(i, i)];
        let own = (v > 0.0 && v < TOLD).then(|| 1.0 / (1.0 / v - 1.0))?;
        Some((self.at[i] / v * own, own))
    }
}

/// Variance, in units of what was known before, up to which data say something of a value.
const TOLD: f64 = 0.5;

/// A step that lowers the cost; none where there is none.
#[expect(clippy::type_complexity, reason = "numbers and residuals, handed straight on")]
fn step(
    target: &Target<'_>,
    (x, residual, jacobian): (&[f64], &[f64], &DMatrix<f64>),
    cost: f64,
    lambda: &mut f64,
) -> Result<Option<(Vec<f64>, Vec<f64>)>, GapError> {
    let n = x.len();
    let r = DVector::from_column_slice(residual);
    let normal = jacobian.tr_mul(jacobian) + DMatrix::identity(n, n);
    let gradient = jacobian.tr_mul(&r) + DVector::from_column_slice(x);
    for _ in 0..TRIES {
        let mut damped = normal.clone();
        (0..n).for_each(|i| damped[(i, i)] *= 1.0 + *lambda);
        let Some(factor) = damped.cholesky() else { return Ok(None) };
        let by = factor.solve(&gradient);
        let mut next: Vec<f64> = x.iter().zip(by.iter()).map(|(x, by)| x - by).collect();
        target.unknowns.held(&mut next);
        match target.residual(&next) {
            Ok(there) if cost_of(&there, &next) < cost => {
                *lambda = (0.2 * *lambda).max(1e-7);
                return Ok(Some((next, there)));
            }
            Err(error @ (GapError::Stopped | GapError::Spent { .. })) => return Err(error),
            _ => *lambda = (8.0 * *lambda).max(1e-4),
        }
    }
    Ok(None)
}

fn cost_of(residual: &[f64], x: &[f64]) -> f64 {
    residual.iter().chain(x).map(|r| r * r).sum()
}

fn mean_square(residual: &[f64]) -> f64 {
    residual.iter().map(|r| r * r).sum::<f64>() / residual.len().max(1) as f64
}

/// By how much the variance of an estimate is greater than that of white noise of the size that was taken: max(1, X tau), of the stage where
/// that is greatest.
fn inflation(residual: &[f64], stages: usize) -> f64 {
    let length = residual.len() / stages.max(1);
    let parts = residual.chunks(length.max(1));
    parts.map(|r| mean_square(r) * correlation_time(r)).fold(1.0, f64::max)
}

/// 1 + 2 sum of the autocorrelations while pairs of them are positive (Geyer's initial positive sequence).
fn correlation_time(r: &[f64]) -> f64 {
    let mean = r.iter().sum::<f64>() / r.len().max(1) as f64;
    let at =
        |lag: usize| -> f64 { r.iter().zip(&r[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum() };
    let variance = at(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let mut sum = 0.0;
    let mut lag = 1;
    while lag + 1 < r.len() / 4 {
        let pair = (at(lag) + at(lag + 1)) / variance;
        // What white noise has of it by chance is none.
        if pair <= 2.0 / (r.len() as f64).sqrt() {
            break;
        }
        sum += pair;
        lag += 2;
    }
    1.0 + 2.0 * sum
}
