//! Joint fits: all nominal parameters of the stages concerned and those of the effects, maximum a posteriori in a
//! box, by Levenberg-Marquardt.

use crate::{
    error::GapError,
    frame::{Column, Frame, Metric, Role, dot},
    linear::{Cholesky, boxed},
    simulator::{Model, Run, Simulator},
};

/// Everything a fit needs to know; shared by all candidates.
pub(crate) struct Bench<'a> {
    pub(crate) simulator: &'a dyn Simulator,
    pub(crate) frame: Frame,
    /// One per stage.
    pub(crate) metrics: Vec<Metric>,
    /// Trials that fits run, from the first.
    pub(crate) trials: usize,
    /// By stage: samples that count as one, from the memory of the re-tuned nominal's residual.
    pub(crate) memory: Vec<f64>,
    /// By stage: what of the measured input's noise arrives through the re-tuned nominal.
    pub(crate) arriving: Vec<Misfit>,
    pub(crate) stop: &'a (dyn Fn() -> bool + Sync),
}

/// Mean squares of one stage in units of its floor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Misfit {
    pub(crate) stage: usize,
    pub(crate) fit: f64,
    pub(crate) held: f64,
}

/// A fit of some stages with some effects.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) model: Model,
    pub(crate) misfits: Vec<Misfit>,
    /// One standard deviation of each effect parameter, in the order of the model's effects.
    pub(crate) effect_sd: Vec<Vec<f64>>,
}

/// One coordinate of a fit.
#[derive(Debug, Clone, Copy)]
enum Coordinate {
    Nominal { index: usize, nominal: f64, sd: f64 },
    Linear { slot: usize, index: usize, range: f64, usual: Option<f64> },
    Log { slot: usize, index: usize, middle: f64, half: f64 },
}

impl Coordinate {
    fn read(self, model: &Model) -> f64 {
        match self {
            Self::Nominal { index, nominal, sd } => (model.parameters[index] - nominal) / sd,
            Self::Linear { slot, index, range, .. } => model.effects[slot].1[index] / range,
            Self::Log { slot, index, .. } => model.effects[slot].1[index].max(1e-300).ln(),
        }
    }

    fn write(self, model: &mut Model, x: f64) {
        match self {
            Self::Nominal { index, nominal, sd } => model.parameters[index] = nominal + sd * x,
            Self::Linear { slot, index, range, .. } => model.effects[slot].1[index] = x * range,
            Self::Log { slot, index, .. } => model.effects[slot].1[index] = x.exp(),
        }
    }

    /// Slope and curvature of the prior.
    fn prior(self, x: f64) -> (f64, f64, f64) {
        match self {
            Self::Nominal { .. } => (0.5 * x * x, x, 1.0),
            Self::Linear { usual: Some(usual), .. } => {
                let z = (x - usual) / FORM_SD;
                (0.5 * z * z, z / FORM_SD, 1.0 / (FORM_SD * FORM_SD))
            }
            Self::Linear { .. } => (0.0, 0.0, 0.0),
            Self::Log { middle, half, .. } => {
                let z = (x - middle) / half;
                (0.5 * z * z, z / half, 1.0 / (half * half))
            }
        }
    }
}

/// Sensitivities of the nominal parameters of one stage, by parameter.
pub(crate) type Sensitivities = Vec<(usize, Column)>;

/// Standard deviation of a form around its usual value, as a share of its range.
const FORM_SD: f64 = 0.35;

/// Draws of the measured input's noise; the same for every model.
const DRAWS: u64 = 4;
/// Share of a mean square that is left at least when noise is taken from it.
const LEAST_KEPT: f64 = 0.1;

/// How much work a fit may be.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// Most iterations.
    iterations: usize,
    /// Iterations at which the sensitivities of the nominal parameters are taken anew.
    renewals: &'static [usize],
}

/// Enough to see whether a candidate can compete.
pub(crate) const COARSE: Effort = Effort { iterations: 5, renewals: &[1, 3] };
/// Until nothing is gained.
pub(crate) const FINE: Effort = Effort { iterations: 14, renewals: &[1, 3, 6, 9] };

impl Bench<'_> {
    /// The same session beside another simulator of it.
    pub(crate) fn beside<'b>(
        &'b self,
        simulator: &'b dyn Simulator,
        metrics: Vec<Metric>,
    ) -> Bench<'b> {
        Bench {
            simulator,
            frame: self.frame.clone(),
            metrics,
            trials: self.trials,
            memory: self.memory.clone(),
            arriving: Vec::new(),
            stop: self.stop,
        }
    }

    /// Residual of a stage, measured minus simulated in floors.
    pub(crate) fn residual(&self, stage: usize, model: &Model) -> Result<Column, GapError> {
        let values = self.residual_values(stage, model)?;
        Ok(self.metrics[stage].column(&self.frame, values))
    }

    pub(crate) fn simulate(&self, stage: usize, model: &Model) -> Result<Vec<f64>, GapError> {
        if (self.stop)() {
            return Err(GapError::Stopped);
        }
        let trials = self.trials;
        let mut out = vec![0.0; self.frame.samples(trials)];
        self.simulator.simulate(Run { stage, model, trials, shake: None, step: 1.0 }, &mut out)?;
        Ok(out)
    }

    pub(crate) fn misfit(&self, stage: usize, residual: &Column) -> Misfit {
        let mean = |role| {
            let n = self.frame.count(role) as f64;
            let sum = self.metrics[stage].product(&self.frame, residual, residual, role);
            if n > 0.0 { sum / n } else { 1.0 }
        };
        Misfit { stage, fit: mean(Role::Fit), held: mean(Role::Held) }
    }

    /// Mean square over fitted and held-out samples, in floors.
    pub(crate) fn mean_square(&self, misfit: &Misfit) -> f64 {
        let (fit, held) = (self.frame.blocks(Role::Fit), self.frame.blocks(Role::Held));
        (fit * misfit.fit + held * misfit.held) / (fit + held)
    }

    /// What of the measured input's noise arrives at the output of a stage.
    pub(crate) fn arriving(&self, stage: usize, model: &Model) -> Result<Misfit, GapError> {
        let plain = self.simulate(stage, model)?;
        let mut shaken = vec![0.0; plain.len()];
        let mut mean = Misfit { stage, ..Misfit::default() };
        for draw in 0..DRAWS {
            let run = Run { stage, model, trials: self.trials, shake: Some(draw), step: 1.0 };
            self.simulator.simulate(run, &mut shaken)?;
            for ((x, y), sd) in shaken.iter_mut().zip(&plain).zip(&self.metrics[stage].sd) {
                *x = (*x - y) / sd;
            }
            let power = |role| {
                let parts = self.frame.of_role(role).map(|s| &shaken[s.from..s.to]);
                let sum: f64 = parts.map(|part| dot(part, part)).sum();
                sum / (self.frame.count(role) as f64).max(1.0)
            };
            mean.fit += power(Role::Fit) / DRAWS as f64;
            mean.held += power(Role::Held) / DRAWS as f64;
            if mean.fit == 0.0 {
                break;
            }
        }
        Ok(mean)
    }

    /// Misfit of a model beside others: an effect that happens to keep the measured input's noise from the output (a slow
    /// amplifier, a slipping sleeve) is no better for that, and what it keeps away is given back.
    fn fair_misfit(
        &self,
        stage: usize,
        model: &Model,
        residual: &Column,
    ) -> Result<Misfit, GapError> {
        let mut misfit = self.misfit(stage, residual);
        let effects = self.simulator.effects();
        let acts = model.effects.iter().any(|(e, _)| effects[*e].touches.contains(&stage));
        if let Some(nominal) = self.arriving.get(stage).filter(|n| acts && n.fit > 0.0) {
            let own = self.arriving(stage, model)?;
            // Where the noise is known too large, more could be taken than there is.
            misfit.fit = (misfit.fit + nominal.fit - own.fit).max(LEAST_KEPT * misfit.fit);
            misfit.held = (misfit.held + nominal.held - own.held).max(LEAST_KEPT * misfit.held);
        }
        Ok(misfit)
    }

    fn coordinates(&self, stages: &[usize], model: &Model) -> (Vec<Coordinate>, Vec<[f64; 2]>) {
        let specs = self.simulator.parameters();
        let mut coordinates = Vec::new();
        let mut bounds = Vec::new();
        for &stage in stages {
            for &index in &self.simulator.stages()[stage].parameters {
                let p = &specs[index];
                if p.sd > 0.0 {
                    coordinates.push(Coordinate::Nominal { index, nominal: p.nominal, sd: p.sd });
                    bounds.push([((p.least - p.nominal) / p.sd).max(-3.0), 3.0]);
                }
            }
        }
        for (slot, (effect, values)) in model.effects.iter().enumerate() {
            for (index, p) in self.simulator.effects()[*effect].parameters.iter().enumerate() {
                // A second threshold that is off stays off: it is another form of the effect.
                let is_other = index > 0 || values.len() > 1;
                if !p.is_fitted
                    || (is_other && p.off == Some(values[index]) && values[index] != 0.0)
                {
                    continue;
                }
                if p.is_log {
                    let (a, b) = (p.min.ln(), p.max.ln());
                    // A form is looked for near its usual value, anything else in the whole range.
                    let (middle, half) = match p.form {
                        Some(usual) => (usual.ln(), FORM_SD * (b - a)),
                        None => (0.5 * (a + b), 0.5 * (b - a)),
                    };
                    coordinates.push(Coordinate::Log { slot, index, middle, half });
                    bounds.push([a, b]);
                } else {
                    let range = p.max - p.min;
                    let usual = p.form.map(|usual| usual / range);
                    coordinates.push(Coordinate::Linear { slot, index, range, usual });
                    bounds.push([p.min / range, p.max / range]);
                }
            }
        }
        (coordinates, bounds)
    }

    fn residuals(&self, stages: &[usize], model: &Model) -> Result<Vec<Column>, GapError> {
        stages.iter().map(|&s| self.residual(s, model)).collect()
    }

    /// Samples of a residual that count as one observation of its mean square, 1 + 2 sum of squared autocorrelations
    /// (Bartlett 1946, doi 10.2307/2983611), at most a block.
    pub(crate) fn memory_of(&self, stage: usize, residual: &Column) -> f64 {
        let mut values = residual.values.clone();
        self.metrics[stage].clean(&self.frame, &mut values);
        let parts: Vec<&[f64]> =
            self.frame.of_role(Role::Fit).map(|s| &values[s.from..s.to]).collect();
        let product = |lag: usize| -> f64 {
            parts
                .iter()
                .filter(|p| p.len() > lag)
                .map(|p| dot(&p[lag..], &p[..p.len() - lag]))
                .sum()
        };
        let power = product(0).max(1e-300);
        let sum: f64 = (1..=2 * self.frame.block).map(|lag| (product(lag) / power).powi(2)).sum();
        (1.0 + 2.0 * sum).min(self.frame.block as f64)
    }

    /// What the forms of a model's effects cost for lying off their usual values.
    pub(crate) fn form_cost(&self, model: &Model) -> f64 {
        let (coordinates, _) = self.coordinates(&[], model);
        coordinates
            .iter()
            .filter(|c| match **c {
                Coordinate::Linear { usual, .. } => usual.is_some(),
                Coordinate::Log { slot, index, .. } => {
                    let effect = model.effects[slot].0;
                    self.simulator.effects()[effect].parameters[index].form.is_some()
                }
                Coordinate::Nominal { .. } => false,
            })
            .map(|c| c.prior(c.read(model)).0)
            .sum()
    }

    /// What it costs that an effect may act in one of several ways (a saturation at either end): a logarithm of their number
    /// for each that acts in one of them only.
    pub(crate) fn choice_cost(&self, model: &Model) -> f64 {
        let one = |(effect, values): &(usize, Vec<f64>)| {
            let specs = &self.simulator.effects()[*effect].parameters;
            let ways = specs.iter().zip(values).filter_map(|(p, v)| p.off.map(|off| off == *v));
            let off = ways.clone().filter(|is_off| *is_off).count();
            if off > 0 { (ways.count() as f64).ln() } else { 0.0 }
        };
        model.effects.iter().map(one).sum()
    }

    fn weight(&self) -> f64 {
        1.0 / self.frame.block as f64
    }

    fn cost(
        &self,
        stages: &[usize],
        coordinates: &[Coordinate],
        model: &Model,
        residuals: &[Column],
    ) -> f64 {
        let data: f64 = stages
            .iter()
            .zip(residuals)
            .map(|(&s, r)| self.metrics[s].product(&self.frame, r, r, Role::Fit))
            .sum();
        let prior: f64 = coordinates.iter().map(|c| c.prior(c.read(model)).0).sum();
        0.5 * self.weight() * data + prior
    }

    /// Sensitivity of the stages to one coordinate; none where it does not act.
    fn sensitivity(
        &self,
        stages: &[usize],
        coordinate: Coordinate,
        bounds: [f64; 2],
        model: &Model,
        residuals: &[Column],
    ) -> Result<Vec<Option<Column>>, GapError> {
        let x = coordinate.read(model);
        let step = match coordinate {
            Coordinate::Nominal { .. } => 0.03,
            Coordinate::Linear { .. } => (2e-4_f64).max(0.02 * x.abs()),
            Coordinate::Log { .. } => 0.03,
        };
        let step = if x + step > bounds[1] { -step } else { step };
        let mut moved = model.clone();
        coordinate.write(&mut moved, x + step);
        stages
            .iter()
            .zip(residuals)
            .map(|(&stage, residual)| {
                let acts = match coordinate {
                    Coordinate::Nominal { index, .. } => {
                        self.simulator.stages()[stage].parameters.contains(&index)
                    }
                    Coordinate::Linear { slot, .. } | Coordinate::Log { slot, .. } => {
                        self.simulator.effects()[model.effects[slot].0].touches.contains(&stage)
                    }
                };
                if !acts {
                    return Ok(None);
                }
                let there = self.residual_values(stage, &moved)?;
                let values =
                    residual.values.iter().zip(there).map(|(a, b)| (a - b) / step).collect();
                Ok(Some(self.metrics[stage].column(&self.frame, values)))
            })
            .collect()
    }

    pub(crate) fn residual_values(
        &self,
        stage: usize,
        model: &Model,
    ) -> Result<Vec<f64>, GapError> {
        let mut values = self.simulate(stage, model)?;
        let measured = self.simulator.measured(stage);
        for ((x, m), sd) in values.iter_mut().zip(measured).zip(&self.metrics[stage].sd) {
            *x = (m - *x) / sd;
        }
        Ok(values)
    }

    /// Sensitivities of a stage to its nominal parameters at a model, one standard deviation each.
    pub(crate) fn nominal_sensitivities(
        &self,
        stage: usize,
        model: &Model,
        residual: &Column,
    ) -> Result<Sensitivities, GapError> {
        use rayon::prelude::*;
        let stages = [stage];
        let (coordinates, bounds) = self.coordinates(&stages, model);
        let residuals = std::slice::from_ref(residual);
        let columns: Result<Vec<_>, GapError> = coordinates
            .par_iter()
            .zip(&bounds)
            .map(|(&c, &b)| {
                let Coordinate::Nominal { index, .. } = c else { return Ok(None) };
                let column = self.sensitivity(&stages, c, b, model, residuals)?.swap_remove(0);
                Ok(column.map(|column| (index, column)))
            })
            .collect();
        Ok(columns?.into_iter().flatten().collect())
    }

    /// Fits from a starting model. `known` holds sensitivities of the nominal parameters near the start, by stage.
    pub(crate) fn fit(
        &self,
        stages: &[usize],
        start: Model,
        known: &[Option<Sensitivities>],
        effort: Effort,
    ) -> Result<Fitted, GapError> {
        let (coordinates, bounds) = self.coordinates(stages, &start);
        let n = coordinates.len();
        let mut model = start;
        for (c, b) in coordinates.iter().zip(&bounds) {
            let x = c.read(&model);
            c.write(&mut model, x.clamp(b[0], b[1]));
        }
        let mut residuals = self.residuals(stages, &model)?;
        let mut cost = self.cost(stages, &coordinates, &model, &residuals);
        let mut columns: Vec<Vec<Option<Column>>> = vec![Vec::new(); n];
        let mut lambda = 1e-3;
        let mut normal = vec![0.0; n * n];
        for iteration in 0..effort.iterations {
            let renew =
                effort.renewals.contains(&iteration) || (iteration == 0 && known.is_empty());
            for (i, (&c, &b)) in coordinates.iter().zip(&bounds).enumerate() {
                let reuse = match c {
                    Coordinate::Nominal { index, .. } if iteration == 0 && !known.is_empty() => {
                        Some(index)
                    }
                    Coordinate::Nominal { .. } if !renew => continue,
                    _ => None,
                };
                columns[i] = match reuse {
                    Some(index) => stages
                        .iter()
                        .map(|&s| {
                            let own = known.get(s).and_then(Option::as_ref)?;
                            own.iter().find(|(p, _)| *p == index).map(|(_, c)| c.clone())
                        })
                        .collect(),
                    None => self.sensitivity(stages, c, b, &model, &residuals)?,
                };
            }
            let mut gradient = vec![0.0; n];
            for i in 0..n {
                for j in 0..=i {
                    let mut sum = 0.0;
                    for (s, &stage) in stages.iter().enumerate() {
                        if let (Some(a), Some(b)) = (&columns[i][s], &columns[j][s]) {
                            sum += self.metrics[stage].product(&self.frame, a, b, Role::Fit);
                        }
                    }
                    normal[i * n + j] = self.weight() * sum;
                    normal[j * n + i] = normal[i * n + j];
                }
                for (s, &stage) in stages.iter().enumerate() {
                    if let Some(a) = &columns[i][s] {
                        let product =
                            self.metrics[stage].product(&self.frame, a, &residuals[s], Role::Fit);
                        gradient[i] -= self.weight() * product;
                    }
                }
                let (_, slope, curvature) = coordinates[i].prior(coordinates[i].read(&model));
                gradient[i] += slope;
                normal[i * n + i] += curvature;
            }
            let before = cost;
            let mut moved = false;
            for _ in 0..5 {
                let mut damped = normal.clone();
                for i in 0..n {
                    damped[i * n + i] += lambda * normal[i * n + i] + 1e-12;
                }
                let x: Vec<f64> = coordinates.iter().map(|c| c.read(&model)).collect();
                let low: Vec<f64> = bounds.iter().zip(&x).map(|(b, x)| b[0] - x).collect();
                let high: Vec<f64> = bounds.iter().zip(&x).map(|(b, x)| b[1] - x).collect();
                // A logarithm goes a factor of three at most, at once.
                let cap = |i: usize| match coordinates[i] {
                    Coordinate::Log { .. } => 1.1,
                    Coordinate::Linear { .. } => 0.4,
                    Coordinate::Nominal { .. } => 6.0,
                };
                let low: Vec<f64> = low.iter().enumerate().map(|(i, l)| l.max(-cap(i))).collect();
                let high: Vec<f64> = high.iter().enumerate().map(|(i, h)| h.min(cap(i))).collect();
                let step = boxed(&damped, &gradient, &low, &high);
                let mut next = model.clone();
                for ((c, x), s) in coordinates.iter().zip(&x).zip(&step) {
                    c.write(&mut next, x + s);
                }
                let trial = self.residuals(stages, &next);
                if let Err(GapError::Stopped) = trial {
                    return Err(GapError::Stopped);
                }
                if let Ok(there) = trial {
                    let new_cost = self.cost(stages, &coordinates, &next, &there);
                    if new_cost < cost {
                        (model, residuals, cost) = (next, there, new_cost);
                        lambda = (0.2 * lambda).max(1e-7);
                        moved = true;
                        break;
                    }
                }
                lambda = (8.0 * lambda).max(1e-4);
            }
            let gain = before - cost;
            if gain < 0.03 + 2e-5 * cost {
                if renew {
                    break;
                }
                if !moved && lambda > 1e3 {
                    break;
                }
            }
        }
        let misfits: Result<Vec<Misfit>, GapError> =
            stages.iter().zip(&residuals).map(|(&s, r)| self.fair_misfit(s, &model, r)).collect();
        let spread = spreads(&normal, n);
        let mut effect_sd: Vec<Vec<f64>> =
            model.effects.iter().map(|(_, v)| vec![0.0; v.len()]).collect();
        for (i, c) in coordinates.iter().enumerate() {
            let (slot, index, sd) = match *c {
                Coordinate::Nominal { .. } => continue,
                Coordinate::Linear { slot, index, range, .. } => (slot, index, spread[i] * range),
                Coordinate::Log { slot, index, .. } => {
                    (slot, index, spread[i] * model.effects[slot].1[index])
                }
            };
            effect_sd[slot][index] = sd;
        }
        Ok(Fitted { model, misfits: misfits?, effect_sd })
    }
}

/// Standard deviations from a normal matrix.
fn spreads(normal: &[f64], n: usize) -> Vec<f64> {
    let mut lifted = normal.to_vec();
    for i in 0..n {
        lifted[i * n + i] += 1e-12;
    }
    let factor = Cholesky::of(&lifted, n);
    (0..n)
        .map(|i| {
            let mut unit = vec![0.0; n];
            unit[i] = 1.0;
            factor.solve(&mut unit);
            unit[i].max(0.0).sqrt()
        })
        .collect()
}
