//! Cheap look at every effect: the change that it would make, nominal sensitivities projected out.

use crate::{
    error::GapError,
    fit::{Bench, Sensitivities},
    frame::{Column, Role},
    linear::Cholesky,
    simulator::Model,
};

/// What a screen says of one effect.
#[derive(Debug, Clone)]
pub(crate) struct Screened {
    pub(crate) effect: usize,
    /// Starting points for a fit, the best first, with the reduction of the cost each promises.
    pub(crate) starts: Vec<(Vec<f64>, f64)>,
}

impl Screened {
    pub(crate) fn gain(&self) -> f64 {
        self.starts.first().map_or(0.0, |s| s.1)
    }
}

/// State of a stage that screens start from.
pub(crate) struct Ground {
    pub(crate) model: Model,
    /// Residuals by stage.
    pub(crate) residuals: Vec<Column>,
    /// Sensitivities of nominal parameters by stage.
    pub(crate) known: Vec<Option<Sensitivities>>,
    /// Factor of their normal matrix (with the prior), and what it makes of the residual, by stage.
    solved: Vec<(Cholesky, Vec<f64>)>,
}

impl Ground {
    /// Around a model.
    pub(crate) fn around(bench: &Bench<'_>, model: Model) -> Result<Self, GapError> {
        use rayon::prelude::*;
        let stages = bench.simulator.stages().len();
        let parts: Result<Vec<_>, GapError> = (0..stages)
            .into_par_iter()
            .map(|s| {
                let residual = bench.residual(s, &model)?;
                let known = bench.nominal_sensitivities(s, &model, &residual)?;
                let solved = bench.solved(s, &known, &residual);
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

impl Bench<'_> {
    /// Screens one effect on top of a model.
    pub(crate) fn screen(&self, ground: &Ground, effect: usize) -> Result<Screened, GapError> {
        let spec = &self.simulator.effects()[effect];
        let mut starts = Vec::new();
        for values in &spec.starts {
            let Some((own, with_residual)) = self.change(ground, effect, values)? else { continue };
            let weight = 1.0 / self.frame.block as f64;
            // Strengths scale with the amplitude; thresholds do not scale at all.
            let scalable = spec.parameters[0].off == Some(0.0);
            let (value, range) = (values[0], &spec.parameters[0]);
            let alpha = with_residual / own;
            let (least, most) = if scalable && value != 0.0 {
                let (a, b) = (range.min / value, range.max / value);
                (a.min(b).max(-8.0), a.max(b).min(8.0))
            } else {
                (0.0, 1.5)
            };
            let alpha = alpha.clamp(least, most);
            let gain = weight * (alpha * with_residual - 0.5 * alpha * alpha * own);
            let mut start = values.clone();
            if scalable {
                let size = if alpha.abs() < 0.02 { 0.02 * alpha.signum() } else { alpha };
                start[0] = (value * size).clamp(range.min, range.max);
            }
            starts.push((start, gain));
        }
        starts.sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(Screened { effect, starts })
    }

    /// Squares of the change that an effect makes, and its product with the residual, both without what the nominal
    /// parameters can do; none where it makes none or cannot be simulated.
    pub(crate) fn change(
        &self,
        ground: &Ground,
        effect: usize,
        values: &[f64],
    ) -> Result<Option<(f64, f64)>, GapError> {
        let mut model = ground.model.clone();
        model.effects.push((effect, values.to_vec()));
        let (mut own, mut mixed) = (0.0, 0.0);
        for &stage in &self.simulator.effects()[effect].touches {
            let there = match self.residual_values(stage, &model) {
                Ok(there) => there,
                Err(GapError::Stopped) => return Err(GapError::Stopped),
                Err(_) => return Ok(None),
            };
            let here = &ground.residuals[stage].values;
            let change = here.iter().zip(&there).map(|(a, b)| a - b).collect();
            let change = self.metrics[stage].column(&self.frame, change);
            let (squares, product) = self.projected(stage, ground, &change);
            own += squares;
            mixed += product;
        }
        Ok((own > 1e-9).then_some((own, mixed)))
    }

    fn solved(
        &self,
        stage: usize,
        known: &Sensitivities,
        residual: &Column,
    ) -> (Cholesky, Vec<f64>) {
        let metric = &self.metrics[stage];
        let product = |a: &Column, b: &Column| metric.product(&self.frame, a, b, Role::Fit);
        let n = known.len();
        let mut normal = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let p = product(&known[i].1, &known[j].1);
                normal[i * n + j] = p;
                normal[j * n + i] = p;
            }
            // The prior: one standard deviation is 1, and a block counts as one sample.
            normal[i * n + i] += self.frame.block as f64;
        }
        let factor = Cholesky::of(&normal, n);
        let mut of_residual: Vec<f64> = known.iter().map(|(_, k)| product(k, residual)).collect();
        factor.forward(&mut of_residual);
        (factor, of_residual)
    }

    /// Squares of a change, and its product with the residual, both without what the nominal parameters can do.
    fn projected(&self, stage: usize, ground: &Ground, change: &Column) -> (f64, f64) {
        let metric = &self.metrics[stage];
        let residual = &ground.residuals[stage];
        let product = |a: &Column, b: &Column| metric.product(&self.frame, a, b, Role::Fit);
        let mut own = product(change, change);
        let mut mixed = product(change, residual);
        let (factor, of_residual) = &ground.solved[stage];
        if let Some(known) = ground.known[stage].as_ref().filter(|k| !k.is_empty()) {
            let mut of_change: Vec<f64> = known.iter().map(|(_, k)| product(k, change)).collect();
            factor.forward(&mut of_change);
            own -= of_change.iter().map(|x| x * x).sum::<f64>();
            mixed -= of_change.iter().zip(of_residual).map(|(x, y)| x * y).sum::<f64>();
        }
        (own.max(0.0), mixed)
    }
}
