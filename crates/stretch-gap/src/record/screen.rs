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
//! free. The error of a parameter is estimated from its re-tuned value, without its tolerance. Then two
//! simulations per stage show what remains after one step of all parameters within their tolerances,
//! from each of two starting points. One is the rig as shipped, because a large error distorts the
//! re-tuned parameters. The other is the re-tuned rig, which is better for a small error.

use rayon::prelude::*;

use crate::{
    fit::{levenberg_marquardt::possible, metric::Column as Weighted, prepared::PreparedProblem},
    problem::{
        altered::Altered,
        error::GapError,
        fault::{DELAY_S, Fault, Kind},
        sample_roles::Role,
        simulator::Model,
        spec::REACH,
    },
    search::screen::Ground,
};

/// Step in samples at which the correlation with a delayed output is evaluated.
const STEP: usize = 2;
/// Factors that are tried for commands.
const COMMANDS: [f64; 4] = [0.5, 0.8, 1.25, 2.0];
/// Factors at which a parameter is tried in addition to its estimate: smaller, larger.
const FACTORS: [[f64; 2]; 2] = [[0.6, 0.2], [1.5, 5.0]];
/// Share of the largest allowed deviation (`REACH` standard deviations) beyond which a parameter
/// counts as at the end of its tolerance.
pub(crate) const END: f64 = 0.99;

/// An error that could explain part of the gap.
#[derive(Debug, Clone)]
pub(crate) struct Promising {
    pub(crate) fault: usize,
    /// Models that a fit may start from: the one that promises most, and the one near the rig as
    /// shipped. The parameters of the latter have not been distorted by re-tuning in the presence of
    /// a large error.
    pub(crate) starts: [Model; 2],
    /// Reduction of the sum of squares, in multiples of the noise variance.
    pub(crate) fall: f64,
    /// Reduction as a share of the excess in the stages that the error affects.
    pub(crate) share: f64,
}

/// The two models around which every error is screened.
pub(crate) struct Bench<'a, 'p, 's> {
    problem: &'a PreparedProblem<'p>,
    suspect: &'a Altered<'s>,
    /// Linearisations around the rig as shipped and around the re-tuned nominal model.
    grounds: [Ground; 2],
    /// Output as shipped over the fitted trials, by stage.
    outputs: Vec<Vec<f64>>,
    /// Sum of squares that the re-tuned nominal model leaves, by stage.
    left: Vec<f64>,
}

impl<'a, 'p, 's> Bench<'a, 'p, 's> {
    pub(crate) fn new(
        problem: &'a PreparedProblem<'p>,
        suspect: &'a Altered<'s>,
    ) -> Result<Self, GapError> {
        let compare = &problem.compare;
        let stages = 0..compare.metrics.len();
        let trials = compare.roles.fit_trials;
        let outputs = stages.clone().map(|s| compare.runs.output(s, &problem.shipped, trials));
        let outputs = outputs.collect::<Result<_, _>>()?;
        let retuned = Ground::around(compare, problem.nominal.model.clone())?;
        let shipped = Ground::around(compare, problem.shipped.clone())?;
        let grounds = [shipped, retuned];
        let mut bench = Self { problem, suspect, grounds, outputs, left: Vec::new() };
        let [_, retuned] = &bench.grounds;
        let left = stages.map(|s| bench.squares(s, retuned, retuned.residuals[s].clone()));
        bench.left = left.collect();
        Ok(bench)
    }

    /// Returns the most promising size of one error, with the reduction of the gap that it promises.
    /// `None` if no size is tried or none can be simulated.
    pub(crate) fn look(&self, fault: usize) -> Result<Option<Promising>, GapError> {
        let one = &self.suspect.faults[fault];
        let sizes = self.sizes(one);
        let best = |ground: &Ground| -> Result<Option<(Model, f64)>, GapError> {
            let tried = possible(sizes.par_iter().map(|size| self.tried(ground, fault, *size)))?;
            Ok(tried.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)))
        };
        let [shipped, retuned] = &self.grounds;
        let (shipped, retuned) = (best(shipped)?, best(retuned)?);
        let all = || shipped.iter().chain(&retuned);
        let most = all().max_by(|a, b| a.1.total_cmp(&b.1));
        let (Some((start, fall)), Some((plain, _))) = (most, all().next()) else { return Ok(None) };
        let noise = self.problem.compare.roles.count(Role::Fit) as f64;
        let before = one.spec.touches.iter().map(|&s| (self.left[s] - noise).max(0.0));
        let share = fall / before.sum::<f64>().max(1.0);
        let starts = [start.clone(), plain.clone()];
        Ok(Some(Promising { fault, starts, fall: *fall, share }))
    }

    /// Adds an error to a model, steps the parameters once, and simulates what remains. Returns the
    /// model with the reduction of the sum of squares.
    fn tried(&self, ground: &Ground, fault: usize, size: f64) -> Result<(Model, f64), GapError> {
        let (one, compare) = (&self.suspect.faults[fault], &self.problem.compare);
        let own = &ground.model.parameters;
        let size = match one.kind {
            // Converts the factor on the value as shipped to a factor on the value of the model.
            Kind::Parameter(p) => size * self.problem.shipped.parameters[p] / own[p],
            _ => size,
        };
        let mut model = ground.model.with(self.suspect.index(fault), &[one.clamped(size)]);
        // The sensitivities at a factor of 1 say nothing about a factor beyond that of any sensor.
        for &stage in one.spec.touches.iter().filter(|_| !one.is_beyond(size)) {
            let residual = compare.residual(stage, &model)?;
            let mut step = compare.projected(ground, stage, residual).of_known;
            ground.solved[stage].0.backward(&mut step);
            for ((p, _), step) in ground.known[stage].iter().flatten().zip(step) {
                let spec = &self.problem.simulator().parameters()[*p];
                let to = (own[*p] - spec.nominal) / spec.sd + step;
                let to = spec.nominal + spec.sd * to.clamp(-REACH, REACH);
                model.parameters[*p] = to.max(spec.least);
            }
        }
        let mut fall = 0.0;
        for &stage in &one.spec.touches {
            let residual = compare.residual(stage, &model)?;
            fall += self.left[stage] - self.squares(stage, ground, residual);
        }
        Ok((model, fall))
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
        match (fault.kind, fault.column.map(|c| self.suspect.columns[c].output_of)) {
            (Kind::Parameter(p), _) => self.factors(p),
            (_, Some(Some(stage))) => self.regressed(fault.kind, stage).into_iter().collect(),
            (_, Some(None)) => COMMANDS.into(),
            _ => Vec::new(),
        }
    }

    fn regressed(&self, kind: Kind, stage: usize) -> Option<f64> {
        let measured = self.problem.simulator().measured(stage);
        let simulated = &self.outputs[stage];
        let roles = &self.problem.compare.roles;
        let fitted = || roles.of_role(Role::Fit).flat_map(|s| s.from..s.to);
        let count = roles.count(Role::Fit) as f64;
        let mean = |of: &dyn Fn(usize) -> f64| fitted().map(of).sum::<f64>() / count;
        match kind {
            Kind::Scale => {
                let power = mean(&|i| simulated[i] * simulated[i]);
                let mixed = mean(&|i| measured[i] * simulated[i]);
                Some(mixed / power.max(f64::MIN_POSITIVE)).filter(|factor| *factor > 0.0)
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

    /// Returns the factors of a parameter that are tried. None is tried unless re-tuning moved the
    /// parameter to an end of its tolerance, or would move it beyond that end if there were no
    /// tolerance. Several factors are tried because the estimate shows the direction of a large
    /// error, but not its size.
    fn factors(&self, parameter: usize) -> Vec<f64> {
        let spec = &self.problem.simulator().parameters()[parameter];
        let nominal = &self.problem.nominal;
        let retuned = (nominal.model.parameters[parameter] - spec.nominal) / spec.sd;
        // The tolerance is a prior of variance 1. Without it, the data would shift the value more.
        let free = retuned / (1.0 - (nominal.spread.of_parameter(parameter) / spec.sd).powi(2));
        let is_far = free.abs() > REACH || retuned.abs() > END * REACH;
        if !is_far {
            return Vec::new();
        }
        let factor = 1.0 + free * spec.sd / spec.nominal;
        let [smaller, larger] = FACTORS;
        let rest = if factor < 1.0 { smaller } else { larger };
        std::iter::once(factor.clamp(smaller[1], larger[1])).chain(rest).collect()
    }
}
