//! Estimates cheaply, for every error, how large it would be and how much of the gap it could
//! explain.
//!
//! The influence of an error on an output is known in closed form. Its size is therefore estimated
//! by regression on the output as shipped, without a simulation:
//!
//! ```text
//! scale s = <m, y>/<y, y>,   offset o = mean(m - y),   upside down c = mean(m + y),   delay d = argmin |m(t) - y(t - d)|^2
//! ```
//!
//! m is the measured and y the simulated output; the delay is searched with scale and offset left
//! free. The error of a parameter is estimated by one Gauss-Newton step without its tolerance. Then
//! one or two simulations per stage show what remains, for each of two starting points. One is the
//! rig as shipped after one step of all parameters within their tolerances, because a large error
//! distorts the re-tuned parameters. The other is the re-tuned rig, which is better for a small
//! error.

use rayon::prelude::*;

use crate::{
    fit::{metric::Column as Weighted, prepared::PreparedProblem},
    numerics::linear::dot,
    problem::{error::GapError, sample_roles::Role, simulator::Model},
    record::{
        fault::{DELAY_S, Fault, Kind},
        suspect::Suspect,
    },
    search::screen::Ground,
};

/// Step in samples at which the correlation with a delayed output is evaluated.
const STEP: usize = 2;
/// Scale errors that are tried for commands, as deviations from 1.
const COMMANDS: [f64; 4] = [-0.5, -0.2, 0.25, 1.0];
/// Factors at which a parameter is tried in addition to the Gauss-Newton step, as deviations from
/// 1: smaller, larger.
const FACTORS: [[f64; 2]; 2] = [[-0.4, -0.8], [0.5, 4.0]];
/// Share of the largest allowed deviation (`REACH` standard deviations) beyond which a parameter
/// counts as at the end of its tolerance.
pub(crate) const END: f64 = 0.99;
/// Number of standard deviations from the nominal value within which a parameter does not count as
/// wrong.
pub(crate) const REACH: f64 = 3.0;

/// An error that could explain part of the gap.
#[derive(Debug, Clone)]
pub(crate) struct Promising {
    pub(crate) fault: usize,
    /// Model that a fit may start from.
    pub(crate) start: Model,
    /// Model near the rig as shipped from which a fit may start. Its parameters have not been
    /// distorted by re-tuning in the presence of a large error.
    pub(crate) plain: Option<Model>,
    /// Reduction of the sum of squares, in multiples of the noise variance.
    pub(crate) fall: f64,
    /// Reduction as a share of the excess in the stages that the error affects.
    pub(crate) share: f64,
}

/// The two models around which every error is screened.
pub(crate) struct Bench<'a, 'p, 's> {
    problem: &'a PreparedProblem<'p>,
    suspect: &'a Suspect<'s>,
    /// Linearisation around the re-tuned nominal model.
    ground: &'a Ground,
    /// Linearisation around the rig as shipped.
    shipped: Ground,
    /// Output as shipped over the fitted trials, by stage.
    outputs: Vec<Vec<f64>>,
    /// Sum of squares that the re-tuned nominal model leaves, by stage.
    left: Vec<f64>,
}

impl<'a, 'p, 's> Bench<'a, 'p, 's> {
    pub(crate) fn new(
        problem: &'a PreparedProblem<'p>,
        suspect: &'a Suspect<'s>,
        ground: &'a Ground,
    ) -> Result<Self, GapError> {
        let compare = &problem.compare;
        let stages = 0..compare.metrics.len();
        let trials = compare.roles.fit_trials;
        let outputs = stages.clone().map(|s| compare.runs.output(s, &problem.shipped, trials));
        let outputs = outputs.collect::<Result<_, _>>()?;
        let shipped = Ground::around(compare, problem.shipped.clone())?;
        let mut bench = Self { problem, suspect, ground, shipped, outputs, left: Vec::new() };
        bench.left =
            stages.map(|s| bench.squares(s, ground, ground.residuals[s].clone())).collect();
        Ok(bench)
    }

    /// Returns the most promising size of one error, with the reduction of the gap that it promises. `None` if
    /// no size is tried or none can be simulated.
    pub(crate) fn look(&self, fault: usize) -> Result<Option<Promising>, GapError> {
        let one = &self.suspect.faults()[fault];
        let mut best: Option<Promising> = None;
        let mut plain: Option<(Model, f64)> = None;
        for size in self.sizes(one) {
            let size = one.clamped(size);
            let ends = [self.beside_shipped(fault, size), self.beside_retuned(fault, size)];
            for (end, found) in ends.into_iter().enumerate() {
                let found = match found {
                    Err(error) if error.ends_all() => return Err(error),
                    // A rig that cannot be simulated is not a hypothesis.
                    Err(_) => continue,
                    Ok(found) => found,
                };
                if end == 0 && plain.as_ref().is_none_or(|(_, fall)| found.fall > *fall) {
                    plain = Some((self.with(&self.problem.shipped, fault, size), found.fall));
                }
                if best.as_ref().is_none_or(|b| found.fall > b.fall) {
                    best = Some(found);
                }
            }
        }
        Ok(best.map(|best| Promising { plain: plain.map(|(model, _)| model), ..best }))
    }

    fn promising(&self, fault: usize, start: Model, fall: f64) -> Promising {
        let noise = self.problem.compare.roles.count(Role::Fit) as f64;
        let touches = &self.suspect.faults()[fault].touches;
        let before: f64 = touches.iter().map(|&s| (self.left[s] - noise).max(0.0)).sum();
        Promising { fault, start, plain: None, fall, share: fall / before.max(1.0) }
    }

    fn with(&self, base: &Model, fault: usize, size: f64) -> Model {
        let mut model = base.clone();
        model.effects.push((self.suspect.index(fault), vec![size]));
        model
    }

    /// Starts from the rig as shipped: adds the error, steps the parameters once, and simulates
    /// what remains.
    fn beside_shipped(&self, fault: usize, size: f64) -> Result<Promising, GapError> {
        let mut model = self.with(&self.problem.shipped, fault, size);
        let compare = &self.problem.compare;
        let touches = &self.suspect.faults()[fault].touches;
        for &stage in touches {
            let residual = compare.residual(stage, &model)?;
            let known = self.shipped.known[stage].as_deref().unwrap_or(&[]);
            let mut step = compare.projected(&self.shipped, stage, residual).of_known;
            self.shipped.solved[stage].0.backward(&mut step);
            for ((p, _), step) in known.iter().zip(step) {
                let spec = &self.problem.simulator().parameters()[*p];
                let to = spec.nominal + spec.sd * step.clamp(-REACH, REACH);
                model.parameters[*p] = to.max(spec.least);
            }
        }
        let mut fall = 0.0;
        for &stage in touches {
            let residual = compare.residual(stage, &model)?;
            fall += self.left[stage] - self.squares(stage, &self.shipped, residual);
        }
        Ok(self.promising(fault, model, fall))
    }

    /// Starts from the re-tuned rig: simulates the change that the error causes, and scales the
    /// change so that the reduction is largest.
    fn beside_retuned(&self, fault: usize, size: f64) -> Result<Promising, GapError> {
        let base = &self.problem.nominal.model;
        let one = &self.suspect.faults()[fault];
        let size = match one.kind {
            // Converts the factor on the nominal value to a factor on the re-tuned value.
            Kind::Parameter(p) => {
                let nominal = self.problem.simulator().parameters()[p].nominal;
                (1.0 + size) * nominal / base.parameters[p] - 1.0
            }
            _ => size,
        };
        let model = self.with(base, fault, size);
        let compare = &self.problem.compare;
        let there = one.touches.iter().map(|&stage| compare.residual_values(stage, &model));
        let there = there.collect::<Result<_, GapError>>()?;
        let (own, mixed) = compare.change(self.ground, &one.touches, there).unwrap_or_default();
        let most = if one.kind == Kind::Sign { 1.0 } else { f64::INFINITY };
        let least = if one.kind == Kind::Sign { 1.0 } else { 0.0 };
        let share = (mixed / own.max(f64::MIN_POSITIVE)).clamp(least, most);
        let start = self.with(base, fault, one.clamped(share.min(2.0) * size));
        Ok(self.promising(fault, start, share * (2.0 * mixed - share * own)))
    }

    /// Returns the sum of squares of a residual over the fitted samples, after re-tuning is
    /// projected out.
    fn squares(&self, stage: usize, ground: &Ground, residual: Weighted) -> f64 {
        let compare = &self.problem.compare;
        let residual = compare.projected(ground, stage, residual);
        compare.inner(stage, &residual, &residual)
    }

    /// Returns the sizes of an error that are simulated.
    fn sizes(&self, fault: &Fault) -> Vec<f64> {
        let column = fault.column.map(|c| &self.suspect.columns()[c]);
        match (fault.kind, column) {
            (Kind::Parameter(p), _) => self.factors(fault, p),
            (_, Some(column)) => match column.output_of {
                Some(stage) => self.regressed(fault, stage).into_iter().collect(),
                None => COMMANDS.into(),
            },
            _ => Vec::new(),
        }
    }

    fn regressed(&self, fault: &Fault, stage: usize) -> Option<f64> {
        let measured = self.problem.simulator().measured(stage);
        let simulated = &self.outputs[stage];
        let roles = &self.problem.compare.roles;
        let fitted = || roles.of_role(Role::Fit).flat_map(|s| s.from..s.to);
        let count = roles.count(Role::Fit) as f64;
        let mean = |of: &dyn Fn(usize) -> f64| fitted().map(of).sum::<f64>() / count;
        match fault.kind {
            Kind::Scale => {
                let power = mean(&|i| simulated[i] * simulated[i]);
                let mixed = mean(&|i| measured[i] * simulated[i]);
                fault.of_factor(mixed / power.max(f64::MIN_POSITIVE))
            }
            Kind::Offset => Some(mean(&|i| measured[i] - simulated[i])),
            Kind::Sign => Some(mean(&|i| measured[i] + simulated[i])),
            Kind::Delay => self.delay(measured, simulated),
            Kind::Parameter(_) => None,
        }
    }

    /// Returns the delay at which the simulated output correlates best with the measured one, with
    /// a free offset and a free positive scale; `None` if it is zero.
    fn delay(&self, measured: &[f64], simulated: &[f64]) -> Option<f64> {
        let (roles, dt_s) = (&self.problem.compare.roles, self.problem.simulator().dt_s());
        let reach = (DELAY_S / dt_s) as i64;
        let likeness = |shift: i64| {
            let pairs = roles.of_role(Role::Fit).flat_map(|s| {
                let (from, last) = (s.from as i64, s.to as i64 - 1);
                (from..=last).step_by(STEP).map(move |i| {
                    (measured[i as usize], simulated[(i - shift).clamp(from, last) as usize])
                })
            });
            let (mut n, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for (m, s) in pairs {
                n += 1.0;
                x += s;
                y += m;
                xx += s * s;
                xy += s * m;
            }
            let (power, mixed) = (xx - x * x / n, xy - x * y / n);
            mixed * mixed.abs() / power.max(f64::MIN_POSITIVE)
        };
        let all = (-reach..=reach).into_par_iter().map(|shift| (shift, likeness(shift)));
        let (best, _) = all.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (best != 0).then_some(best as f64 * dt_s)
    }

    /// Returns the factors of a parameter, as deviations from 1, that are tried. None is tried
    /// unless re-tuning moved the parameter to an end of its tolerance, or would move it beyond
    /// that end if there were no tolerance. Several factors are tried because a linearisation shows
    /// the direction of a large error, but not its size.
    fn factors(&self, fault: &Fault, parameter: usize) -> Vec<f64> {
        let spec = &self.problem.simulator().parameters()[parameter];
        let far = |value: f64, reach: f64| (value - spec.nominal).abs() > reach * spec.sd;
        let retuned = self.problem.nominal.model.parameters[parameter];
        let free = self.free(fault, parameter).filter(|value| far(*value, REACH));
        let Some(value) = free.or(far(retuned, END * REACH).then_some(retuned)) else {
            return Vec::new();
        };
        let factor = value / spec.nominal - 1.0;
        let [smaller, larger] = FACTORS;
        let rest = if factor < 0.0 { smaller } else { larger };
        std::iter::once(factor.clamp(smaller[1], larger[1])).chain(rest).collect()
    }

    /// Estimates a parameter by one Gauss-Newton step without its tolerance.
    fn free(&self, fault: &Fault, parameter: usize) -> Option<f64> {
        let compare = &self.problem.compare;
        let spec = &self.problem.simulator().parameters()[parameter];
        let (mut own, mut mixed) = (0.0, 0.0);
        for &stage in &fault.touches {
            let known = self.ground.known[stage].as_ref()?;
            let column = &known.iter().find(|(p, _)| *p == parameter)?.1;
            let others = known.iter().filter(|(p, _)| *p != parameter).cloned().collect();
            let residual = &self.ground.residuals[stage];
            let (factor, mut rest) = compare.solved(stage, &others, residual);
            let mut of_column: Vec<f64> =
                others.iter().map(|(_, k)| compare.product(stage, k, column)).collect();
            factor.forward(&mut of_column);
            rest.truncate(of_column.len());
            own += compare.product(stage, column, column) - dot(&of_column, &of_column);
            mixed += compare.product(stage, column, residual) - dot(&of_column, &rest);
        }
        let retuned = self.problem.nominal.model.parameters[parameter];
        (own > 0.0).then(|| retuned + spec.sd * mixed / own)
    }
}
