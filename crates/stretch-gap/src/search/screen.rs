//! Screens every effect with one simulation per start instead of a fit.
//!
//! A start is a set of parameter values of an effect. Let d be the change of the output that an
//! effect causes at a start, in multiples of the noise, r the residual, and A the sensitivities to
//! the nominal parameters in units of their tolerances (prior precision 1). The changes that the
//! parameters can cause are projected out:
//!
//! ```text
//! <x, y> = x'V^-1 y - x'V^-1 A (A'V^-1 A + b I)^-1 A'V^-1 y
//! ```
//!
//! If the change d is multiplied by a factor a, adding it changes the cost by (0.5 a^2 <d,d> - a
//! <d,r>)/b, with b samples per block. The reduction at the minimum a = <d,r>/<d,d> is the *gain*,
//! half the score statistic of Rao (1948, doi 10.1017/S0305004100023987). A fit starts with the
//! strength of the effect scaled by a; a threshold cannot be scaled, so its start is kept. Gains
//! only select which effects are fitted, because real changes are not linear.

use nalgebra::DMatrix;
use rayon::prelude::*;
use stretch_effects::EffectParameter;

use crate::{
    fit::{
        comparison::{Comparison, Sensitivities},
        metric::Column,
    },
    numerics::linear::{Cholesky, dot},
    problem::{error::GapError, simulator::Model, spec::EffectSpec},
};

/// Largest factor on the strength of a start.
const SCALED: f64 = 8.0;
/// Smallest change that counts, as a sum of squares in multiples of the noise variance.
const NO_CHANGE: f64 = 1e-9;

/// Number of threshold values that are tried between one that changes nothing and one that changes
/// too much.
const BETWEEN: usize = 7;

/// Parameter values of an effect, with <d,d> and <d,r> of the change d that they cause.
type Tried = (Vec<f64>, (f64, f64));

/// The result of the screen of one effect.
#[derive(Debug, Clone)]
pub(crate) struct Screened {
    pub(crate) effect: usize,
    /// Starting points for a fit with the reduction of the cost that each promises, the best first.
    pub(crate) starts: Vec<(Vec<f64>, f64)>,
    /// <d,d> at each start of the catalogue, in the catalogue's order; `None` if nothing changes.
    pub(crate) sizes: Vec<Option<f64>>,
}

impl Screened {
    pub(crate) fn gain(&self) -> f64 {
        self.starts.first().map_or(0.0, |s| s.1)
    }
}

/// A model around which effects are screened, with its residuals and sensitivities.
pub(crate) struct Ground {
    pub(crate) model: Model,
    /// Residuals by stage.
    pub(crate) residuals: Vec<Column>,
    /// Sensitivities of nominal parameters by stage.
    pub(crate) known: Vec<Option<Sensitivities>>,
    /// By stage: Cholesky factor L of the normal matrix of the sensitivities (with the prior), and
    /// L^-1 A'V^-1 r.
    pub(crate) solved: Vec<(Cholesky, Vec<f64>)>,
}

impl Ground {
    /// Linearises all stages around a model.
    pub(crate) fn around(compare: &Comparison<'_>, model: Model) -> Result<Self, GapError> {
        let stages = compare.metrics.len();
        let parts: Result<Vec<_>, GapError> = (0..stages)
            .into_par_iter()
            .map(|s| {
                compare.runs.linearise(s, &model, compare.roles.fit_trials)?;
                let residual = compare.residual(s, &model)?;
                let known = compare.nominal_sensitivities(s, &model, &residual)?;
                let solved = compare.solved(s, &known, &residual);
                Ok((residual, Some(known), solved))
            })
            .collect();
        let (mut residuals, mut knowns, mut solveds) = (Vec::new(), Vec::new(), Vec::new());
        for (residual, known, solved) in parts? {
            residuals.push(residual);
            knowns.push(known);
            solveds.push(solved);
        }
        Ok(Self { model, residuals, known: knowns, solved: solveds })
    }
}

/// A column d of one stage, with a vector that is needed to project out the sensitivities.
pub(crate) struct Projected {
    pub(crate) column: Column,
    /// L^-1 A'V^-1 d, with the factor L of A'V^-1 A + b I.
    pub(crate) of_known: Vec<f64>,
}

impl Comparison<'_> {
    /// Screens one effect that is added to the model of `ground`.
    pub(crate) fn screen(&self, ground: &Ground, effect: usize) -> Result<Screened, GapError> {
        let spec = &self.simulator().effects()[effect];
        let mut starts = Vec::new();
        let changes = self.changes(ground, effect, &spec.starts)?;
        let sizes = changes.iter().map(|change| change.map(|(own, _)| own)).collect();
        let changed = |values: &[Vec<f64>], changes: Vec<Option<(f64, f64)>>| -> Vec<Tried> {
            let pairs = values.iter().zip(changes);
            pairs.filter_map(|(values, change)| Some((values.clone(), change?))).collect()
        };
        let mut tried = changed(&spec.starts, changes);
        let between = jumped_over(spec, &tried);
        if !between.is_empty() {
            let changes = self.changes(ground, effect, &between)?;
            tried.extend(changed(&between, changes));
        }
        for (values, (own, with_residual)) in &tried {
            // A strength scales its change. A threshold cannot be scaled.
            let scalable = spec.parameters[0].off() == Some(0.0);
            let (value, range) = (values[0], &spec.parameters[0]);
            let alpha = with_residual / own;
            let (least, most) = if scalable && value != 0.0 {
                let (a, b) = (range.min / value, range.max / value);
                (a.min(b).max(-SCALED), a.max(b).min(SCALED))
            } else {
                (0.0, 1.5)
            };
            let alpha = alpha.clamp(least, most);
            let promise = |a: f64| self.weight() * (a * with_residual - 0.5 * a * a * own);
            let gain = promise(alpha);
            // The change may be non-linear. Therefore the unscaled start is kept as well, with the
            // gain computed from its simulation.
            if scalable && promise(1.0) > 0.0 {
                starts.push((values.clone(), promise(1.0)));
            }
            let mut start = values.clone();
            if scalable {
                let size = if alpha.abs() < 0.02 { 0.02 * alpha.signum() } else { alpha };
                start[0] = (value * size).clamp(range.min, range.max);
            }
            starts.push((start, gain));
        }
        starts.sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(Screened { effect, starts, sizes })
    }

    /// Returns <d,d> and <d,r> of the change d that an effect causes at each of the given starts;
    /// `None` if nothing changes or the start cannot be simulated.
    pub(crate) fn changes(
        &self,
        ground: &Ground,
        effect: usize,
        starts: &[Vec<f64>],
    ) -> Result<Vec<Option<(f64, f64)>>, GapError> {
        let models: Vec<Model> = starts.iter().map(|v| ground.model.with(effect, v)).collect();
        let touches = &self.simulator().effects()[effect].touches;
        let there = self.possible_residuals(touches, &models)?;
        if !there.is_empty() && there.iter().all(Option::is_none) {
            self.runs.not_fitted(&[effect]);
        }
        Ok(there.into_iter().map(|own| self.change(ground, touches, own?)).collect())
    }

    /// Returns <d,d> and <d,r> of a change d; `there` holds the residuals with the effect, for the
    /// stages that it touches.
    pub(crate) fn change(
        &self,
        ground: &Ground,
        touches: &[usize],
        there: Vec<Vec<f64>>,
    ) -> Option<(f64, f64)> {
        let (mut own, mut mixed) = (0.0, 0.0);
        for (&stage, there) in touches.iter().zip(&there) {
            let change = self.projected_change(ground, stage, there);
            own += self.inner(stage, &change, &change).max(0.0);
            let residual = &ground.residuals[stage];
            mixed += self.product(stage, &change.column, residual)
                - dot(&change.of_known, &ground.solved[stage].1);
        }
        (own > NO_CHANGE).then_some((own, mixed))
    }

    /// Returns the change of one stage's output from the model of `ground` to a model with the
    /// residual `there`.
    pub(crate) fn projected_change(
        &self,
        ground: &Ground,
        stage: usize,
        there: &[f64],
    ) -> Projected {
        let here = &ground.residuals[stage].values;
        let change = here.iter().zip(there).map(|(a, b)| a - b).collect();
        self.projected(ground, stage, self.metrics[stage].column(&self.roles, change))
    }

    /// Prepares a column of one stage for [`Comparison::inner`].
    pub(crate) fn projected(&self, ground: &Ground, stage: usize, column: Column) -> Projected {
        let known = ground.known[stage].iter().flatten();
        let mut of_known: Vec<f64> = known.map(|(_, k)| self.product(stage, k, &column)).collect();
        ground.solved[stage].0.forward(&mut of_known);
        Projected { column, of_known }
    }

    /// Returns <x,y> of two changes of one stage.
    pub(crate) fn inner(&self, stage: usize, x: &Projected, y: &Projected) -> f64 {
        self.product(stage, &x.column, &y.column) - dot(&x.of_known, &y.of_known)
    }

    /// Returns the factor L of A'V^-1 A + b I, and L^-1 A'V^-1 r.
    pub(crate) fn solved(
        &self,
        stage: usize,
        known: &Sensitivities,
        residual: &Column,
    ) -> (Cholesky, Vec<f64>) {
        let product = |a: &Column, b: &Column| self.product(stage, a, b);
        let n = known.len();
        let mut normal = DMatrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let p = product(&known[i].1, &known[j].1);
                normal[(i, j)] = p;
                normal[(j, i)] = p;
            }
            // The prior precision is 1 if a block counts as one observation. This matrix sums over
            // samples, so the precision is multiplied by the b samples of a block.
            normal[(i, i)] += self.roles.block as f64;
        }
        let factor = Cholesky::of(normal);
        let mut of_residual: Vec<f64> = known.iter().map(|(_, k)| product(k, residual)).collect();
        factor.forward(&mut of_residual);
        (factor, of_residual)
    }
}

/// Returns starts with threshold values between the last catalogued start that changes nothing and
/// the first that changes more than twice too much, combined with every shape. The best value may
/// lie between these two. Empty if a catalogued start already lowers the cost, or if the starts are
/// not the automatic ones.
fn jumped_over(spec: &EffectSpec, tried: &[Tried]) -> Vec<Vec<f64>> {
    let threshold = spec.parameters[0].off().filter(|off| *off != 0.0);
    let Some(off) = threshold else { return Vec::new() };
    // Such a start lowers the cost without being scaled.
    let is_promising = tried.iter().any(|(_, (own, with_residual))| *with_residual > 0.5 * own);
    if is_promising || spec.starts != EffectParameter::starts(&spec.parameters) {
        return Vec::new();
    }
    let far = |x: &f64| (x - off).abs();
    let acting = tried.iter().map(|(values, _)| values[0]);
    let Some(acts) = acting.min_by(|a, b| far(a).total_cmp(&far(b))) else { return Vec::new() };
    let nearer = spec.starts.iter().map(|values| values[0]);
    let idle = nearer
        .filter(|x| far(x) < far(&acts) && (x - off) * (acts - off) > 0.0)
        .max_by(|a, b| far(a).total_cmp(&far(b)))
        .unwrap_or(off);
    let mut shapes: Vec<&[f64]> = Vec::new();
    for values in &spec.starts {
        if !shapes.contains(&&values[1..]) {
            shapes.push(&values[1..]);
        }
    }
    let place = |k: usize| acts + (idle - acts) * k as f64 / (BETWEEN + 1) as f64;
    let at = |k: usize| shapes.iter().map(move |shape| [&[place(k)], *shape].concat());
    (1..=BETWEEN).flat_map(at).collect()
}
