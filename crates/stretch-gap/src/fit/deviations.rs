//! Computes deviations of form. No effect of a catalogue has exactly the form of the real effect,
//! so a hypothesis may explain part of its residual by deviations of its effects' forms, without a
//! further effect.
//!
//! Let d be the contribution of an effect to an output, in multiples of the noise: the residual
//! without the effect minus the residual with it. The real effect may have more poles than the form in
//! the catalogue, and a curve of another shape. To first order it contributes
//!
//! ```text
//! d + sum_j c_j b_j,     b = d - L d with lags L of 3, 30 and 300 samples;  z d and (z^2 - 1/3) d,     c_j ~ N(0, s^2)
//! ```
//!
//! Three of the b_j are the differences between d and its output L d from a first-order lag with a
//! time constant of 3, 30 or 300 samples. Two are d multiplied by functions of the simulated output
//! z, which is scaled to the range -1 to 1. s is the *model discrepancy*: the share of an effect's
//! contribution by which another form of the effect may differ (embedded model error: Sargsyan,
//! Najm and Ghanem 2015, doi 10.1002/kin.20906). The b_j are the columns of B. The columns of A are
//! the sensitivities to the nominal parameters and to the effects' strengths. They are fitted
//! together with the deviations, so that a deviation does not explain what a parameter can explain
//! (Plumlee 2017, doi 10.1080/01621459.2016.1211016). The coefficients x = (a, c) of A and B solve
//!
//! ```text
//! N x = [A B]'V^-1 r/b,     N = [A B]'V^-1 [A B]/b + diag(1, 1/s^2)
//! ```
//!
//! with the residual r and b samples in a block. The deviations are fitted to the fitted samples,
//! and lower the reduced chi-square of fitted and of held-out samples. By Laplace's approximation,
//! n deviations cost
//!
//! ```text
//! sum x_i^2 prior_i/2 + (ln det N - ln det N_A + 2 n ln s)/2
//! ```
//!
//! N_A is the part of N that belongs to A. The only new simulations are one per effect, with this
//! effect left out.

use nalgebra::DMatrix;

use crate::{
    fit::{
        comparison::Sensitivities, hypothesis::Hypothesis, metric::Column,
        prepared::PreparedProblem, score::Misfit,
    },
    numerics::linear::{Cholesky, boxed, dot},
    problem::{
        error::{GapError, unless_lost},
        simulator::Model,
    },
};

/// Time constants of further poles, samples.
const LAGS: [f64; 3] = [3.0, 30.0, 300.0];

/// Largest coefficient of a deviation, in standard deviations. If the form would have to deviate by more, the effect is
/// another one.
const MOST: f64 = 2.0;

impl PreparedProblem<'_> {
    /// Returns a hypothesis whose misfits and score include the deviations of its effects' forms;
    /// unchanged if the deviations explain nothing.
    ///
    /// `share` is s of the module documentation.
    pub(crate) fn with_deviations(
        &self,
        set: &Hypothesis,
        share: f64,
    ) -> Result<Hypothesis, GapError> {
        let mut deviating = set.clone();
        let mut price = 0.0;
        for (stage, known) in self.sensitivities.iter().enumerate() {
            if let Some(own) = self.deviations_in(stage, set, known, share)? {
                deviating.misfits[stage] = own.misfit;
                price += own.price;
            }
        }
        deviating.score = self.score(&deviating.misfits, &set.model) - price;
        Ok(if deviating.score > set.score { deviating } else { set.clone() })
    }

    /// Returns the misfit of one stage with deviations, and their cost; `None` if no effect acts in
    /// it.
    fn deviations_in(
        &self,
        stage: usize,
        set: &Hypothesis,
        known: &Sensitivities,
        share: f64,
    ) -> Result<Option<Deviating>, GapError> {
        let compare = &self.compare;
        let effects = self.simulator().effects();
        let mut acting =
            set.effects.iter().copied().filter(|&e| effects[e].touches.contains(&stage)).peekable();
        if acting.peek().is_none() {
            return Ok(None);
        }
        let metric = &compare.metrics[stage];
        let column = |values| metric.column(&compare.roles, values);
        let residual = compare.residual(stage, &set.model)?;
        let level = self.level(stage, &residual.values);
        let (mut free, mut bound) = (Vec::new(), Vec::new());
        free.extend(known.iter().map(|(_, sensitivity)| sensitivity.clone()));
        for effect in acting {
            let mut less = Model::clone(&set.model);
            less.effects.retain(|(e, _)| *e != effect);
            // If the stage cannot be simulated without the effect, the effect's contribution is
            // unknown.
            let without = unless_lost(compare.residual_values(stage, &less))?;
            let Some(without) = without else { continue };
            let doing: Vec<f64> =
                without.iter().zip(&residual.values).map(|(a, b)| a - b).collect();
            bound.extend(self.shapes(&doing, &level).into_iter().map(column));
            free.push(column(doing));
        }
        let (begun, all) = (free.len(), [free, bound].concat());
        let (left, price) = self.explained(stage, &residual, (&all, begun), share);
        let misfit = set.misfits[stage]
            .moved(&compare.misfit(stage, &residual), &compare.misfit(stage, &left));
        Ok(Some(Deviating { misfit, price }))
    }

    /// Returns z of the module documentation: the simulated output, scaled to the range -1 to 1.
    fn level(&self, stage: usize, residual: &[f64]) -> Vec<f64> {
        let sds = &self.compare.metrics[stage].noise.sd;
        let measured = self.simulator().measured(stage).iter();
        let output: Vec<f64> =
            measured.zip(residual).zip(sds).map(|((m, r), sd)| m - r * sd).collect();
        let low = output.iter().copied().fold(f64::INFINITY, f64::min);
        let high = output.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let half = (0.5 * (high - low)).max(f64::MIN_POSITIVE);
        output.iter().map(|y| (y - low) / half - 1.0).collect()
    }

    /// Returns the columns b_j of the module documentation.
    fn shapes(&self, doing: &[f64], level: &[f64]) -> Vec<Vec<f64>> {
        let lagged = LAGS.map(|samples| self.above_lag(doing, samples));
        let bent = |of: fn(f64) -> f64| doing.iter().zip(level).map(|(d, z)| d * of(*z)).collect();
        let curves: [Vec<f64>; 2] = [bent(|z| z), bent(|z| z * z - 1.0 / 3.0)];
        lagged.into_iter().chain(curves).collect()
    }

    /// Returns d - L d of the module documentation. In every trial, the state of the lag begins at
    /// the first value of d.
    fn above_lag(&self, doing: &[f64], samples: f64) -> Vec<f64> {
        let kept = (-1.0 / samples).exp();
        let mut out = Vec::with_capacity(doing.len());
        let mut from = 0;
        for trial in &self.simulator().trials()[..self.compare.roles.fit_trials] {
            let own = &doing[from..(from + trial.samples).min(doing.len())];
            let mut lagged = own.first().copied().unwrap_or(0.0);
            out.extend(own.iter().map(|d| {
                lagged = kept * lagged + (1.0 - kept) * d;
                d - lagged
            }));
            from += trial.samples;
        }
        out
    }

    /// Returns the residual that remains with the most likely coefficients, and their cost, nats.
    /// The first `begun` columns belong to A.
    fn explained(
        &self,
        stage: usize,
        residual: &Column,
        (all, begun): (&[Column], usize),
        share: f64,
    ) -> (Column, f64) {
        let compare = &self.compare;
        let product = |a, b| compare.weight() * compare.product(stage, a, b);
        let prior = |i: usize| if i < begun { 1.0 } else { share.powi(-2) };
        let mut normal = DMatrix::zeros(all.len(), all.len());
        for i in 0..all.len() {
            for j in 0..=i {
                normal[(i, j)] = product(&all[i], &all[j]);
                normal[(j, i)] = normal[(i, j)];
            }
            normal[(i, i)] += prior(i);
        }
        let determinant =
            |n: usize| Cholesky::of(normal.view((0, 0), (n, n)).into_owned()).ln_determinant();
        let occam = determinant(all.len()) - determinant(begun)
            + 2.0 * (all.len() - begun) as f64 * share.ln();
        let slope: Vec<f64> = all.iter().map(|c| -product(c, residual)).collect();
        let most: Vec<f64> = (0..all.len()).map(|i| MOST * prior(i).powf(-0.5)).collect();
        let least: Vec<f64> = most.iter().map(|m| -m).collect();
        let x = boxed(&normal, &slope, &least, &most);
        let weighed: Vec<f64> = x.iter().enumerate().map(|(i, x)| prior(i) * x).collect();
        let mut left = residual.values.clone();
        for (x, column) in x.iter().zip(all) {
            left.iter_mut().zip(&column.values).for_each(|(r, c)| *r -= x * c);
        }
        let left = compare.metrics[stage].column(&compare.roles, left);
        (left, 0.5 * (dot(&x, &weighed) + occam))
    }
}

/// The result of fitting deviations of form to the residual of one stage.
struct Deviating {
    misfit: Misfit,
    /// Cost of the deviations, nats.
    price: f64,
}
