//! Fits the nominal parameters of some stages jointly with the parameters of effects: maximum a
//! posteriori within bounds.
//!
//! With residuals r(x) in the [metric](crate::fit::metric) V and priors p of the [coordinates](crate::fit::coordinate) the cost is
//!
//! ```text
//! J(x) = 0.5/b sum over stages r' V^-1 r - sum ln p(x_i)
//! ```
//!
//! where b is the number of samples in a block: a block counts as one observation, because
//! neighbouring samples are correlated. The method of Levenberg and Marquardt (Marquardt 1963, doi
//! 10.1137/0111030) minimises J. P is -sum ln p(x_i). With sensitivities A = -dr/dx and the damping
//! lambda, the step d solves
//!
//! ```text
//! (N + lambda diag N) d = -g,    N = A'V^-1 A/b + P'',    g = -A'V^-1 r/b + P',    low <= x + d <= high
//! ```
//!
//! Each damped step is computed *within* the bounds ([`boxed`]). If an unbounded step were clipped
//! to the bounds instead, the fit could stop although the cost still falls along a bound.
//! Sensitivities to nominal parameters change little and cost one simulation each, so they are
//! renewed only at a few iterations. Sensitivities to parameters of effects are renewed at every
//! iteration, unless the runs of the effect are costly.
//!
//! Effects and nominal parameters must be fitted together. Otherwise an effect is credited with
//! what the fixed nominal parameters could have explained (Brynjarsdottir and O'Hagan 2014, doi
//! 10.1088/0266-5611/30/11/114007).

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::iter::ParallelIterator;

use crate::{
    fit::{
        comparison::{Comparison, Sensitivities},
        coordinate::{Coordinate, coordinates},
        identifiability::Information,
        metric::Column,
        score::Misfit,
        spread::{Equations, Spread, gradient_noise},
    },
    numerics::linear::boxed,
    problem::{
        error::{GapError, if_possible},
        sample_roles::Role,
        simulator::Model,
    },
};

/// Result of a fit of some stages with some effects.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) model: Model,
    /// J of the module documentation.
    pub(crate) cost: f64,
    /// The misfit of each stage that was fitted.
    pub(crate) misfits: Vec<Misfit>,
    /// How precisely the parameters are known.
    pub(crate) spread: Spread,
    /// The coordinates that were fitted, with their bounds.
    pub(crate) coordinates: Vec<(Coordinate, [f64; 2])>,
    /// N of the module documentation.
    pub(crate) normal: DMatrix<f64>,
    /// Whether the fit stopped with sensitivities that were all simulated at its last point. A
    /// further fit from this point would end at once.
    pub(crate) is_settled: bool,
}

/// Limits of the work that a fit may do.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    /// Largest number of iterations.
    iterations: usize,
    /// Iterations at which the sensitivities to the nominal parameters are renewed.
    renewals: &'static [usize],
    /// Whether the simulator may answer runs from a linearisation around the nominal parameters at
    /// which the fit starts.
    is_rough: bool,
    /// Whether the forms of effects keep the values of the starting model.
    holds_forms: bool,
}

/// Effort that suffices to compare several starts.
pub(crate) const GLANCE: Effort =
    Effort { iterations: 2, renewals: &[], is_rough: true, holds_forms: false };
/// Effort that suffices to see whether a candidate can compete.
pub(crate) const COARSE: Effort =
    Effort { iterations: 5, renewals: &[2], is_rough: true, holds_forms: false };
/// Effort that suffices to converge.
pub(crate) const FINE: Effort =
    Effort { iterations: 14, renewals: &[1, 3, 6, 9], is_rough: false, holds_forms: false };
/// Effort that suffices to converge with fixed forms of effects.
pub(crate) const FINE_OF_FORM: Effort = Effort { holds_forms: true, ..FINE };

/// Effort without a step: computes only the misfit of a model, and how well its parameters are
/// known.
pub(crate) const HELD: Effort =
    Effort { iterations: 0, renewals: &[], is_rough: false, holds_forms: false };

/// Added to every diagonal element of N, because a coordinate without influence has no curvature.
const RIDGE: f64 = 1e-12;
/// Largest number of successive fits, each with new sensitivities.
const DESCENTS: usize = 4;
/// Number of dampings that are tried in one iteration.
const TRIES: usize = 5;
/// An iteration has gained nothing if the cost falls by less than the first number, in nats, plus
/// the second number times the cost.
const LEAST_GAIN: (f64, f64) = (0.03, 2e-5);

impl Comparison<'_> {
    /// Returns J of the module documentation for a model, from the residuals of its stages.
    pub(crate) fn cost(&self, stages: &[usize], model: &Model, residuals: &[Vec<f64>]) -> f64 {
        let column = |(&s, r): (&usize, &Vec<f64>)| self.metrics[s].column(&self.roles, r.clone());
        let columns: Vec<Column> = stages.iter().zip(residuals).map(column).collect();
        cost(self, (stages, &coordinates(self.simulator(), stages, model)), model, &columns)
    }

    /// Fits from a starting model. `known` holds, by stage, sensitivities to the nominal parameters
    /// near the starting model.
    pub(crate) fn fit(
        &self,
        stages: &[usize],
        start: Model,
        known: &[Option<Sensitivities>],
        effort: Effort,
    ) -> Result<Fitted, GapError> {
        let near = effort.is_rough.then(|| start.parameters.clone());
        let mut descent = Descent::new(self, stages, start, near, effort.holds_forms)?;
        if effort.iterations == 0 {
            descent.linearise(known, true, known.is_empty())?;
        }
        for iteration in 0..effort.iterations {
            let is_first = iteration == 0;
            let renew = effort.renewals.contains(&iteration) || (is_first && known.is_empty());
            descent.linearise(known, is_first, renew)?;
            if self.runs.is_spent() {
                break;
            }
            let before = descent.cost;
            let has_moved = descent.step()?;
            let is_still = before - descent.cost < LEAST_GAIN.0 + LEAST_GAIN.1 * descent.cost;
            descent.is_settled = is_still && renew && self.simulator().model_runs().is_none();
            // If there is no progress with old sensitivities, renew them before giving up.
            if is_still && (renew || (!has_moved && descent.lambda > 1e3)) {
                break;
            }
        }
        Ok(descent.finish())
    }

    /// Repeats fits, each from the end of the previous one, while the cost falls by at least
    /// `least`, in nats. Before each fit, the simulator is linearised around the starting model. If
    /// a repetition fails, the result before it is returned.
    pub(crate) fn descend(
        &self,
        stages: &[usize],
        start: Model,
        effort: Effort,
        least: f64,
    ) -> Result<Fitted, GapError> {
        let fit = |start: Model| {
            for &stage in stages {
                self.runs.linearise(stage, &start, self.roles.fit_trials)?;
            }
            self.fit(stages, start, &[], effort)
        };
        let mut best = fit(start)?;
        for _ in 1..DESCENTS {
            if self.runs.is_spent() {
                break;
            }
            let Some(next) = if_possible(fit(best.model.clone()))? else { break };
            let fall = best.cost - next.cost;
            if fall > 0.0 {
                best = next;
            }
            if fall < least {
                break;
            }
        }
        Ok(best)
    }
}

impl Fitted {
    /// Returns the information of the fit about the nominal parameters, with the parameters of
    /// effects fixed.
    pub(crate) fn information(&self) -> Information {
        let nominal = self.coordinates.iter().enumerate().filter_map(|(at, (c, _))| match c {
            Coordinate::Nominal { index, .. } => Some((at, *index)),
            _ => None,
        });
        let (kept, indices): (Vec<usize>, Vec<usize>) = nominal.unzip();
        (indices, self.normal.select_rows(&kept).select_columns(&kept))
    }
}

/// Returns J of the module documentation for some stages and their coordinates, for a model that
/// leaves these residuals.
fn cost(
    compare: &Comparison<'_>,
    (stages, coordinates): (&[usize], &[(Coordinate, [f64; 2])]),
    model: &Model,
    residuals: &[Column],
) -> f64 {
    let squares = |(&s, r): (&usize, &Column)| compare.product(s, r, r);
    let data: f64 = stages.iter().zip(residuals).map(squares).sum();
    let prior: f64 = coordinates.iter().map(|(c, _)| c.prior(c.read(model)).cost).sum();
    0.5 * compare.weight() * data + prior
}

/// Collects the fits that succeeded. A failed simulation excludes its candidate; a request to stop
/// ends all fits.
pub(crate) fn possible<T: Send>(
    fits: impl ParallelIterator<Item = Result<T, GapError>>,
) -> Result<Vec<T>, GapError> {
    fits.filter_map(|fit| if_possible(fit).transpose()).collect()
}

/// State of a running fit.
struct Descent<'a, 'b> {
    compare: &'a Comparison<'b>,
    stages: &'a [usize],
    coordinates: Vec<(Coordinate, [f64; 2])>,
    model: Model,
    /// Parameters around which the simulator may linearise; `None` if every run is exact.
    near: Option<Vec<f64>>,
    /// The residual of each stage, in the order of `stages`.
    residuals: Vec<Column>,
    cost: f64,
    /// Sensitivities by coordinate, then by stage; `None` if a coordinate does not act.
    columns: Vec<Vec<Option<Column>>>,
    /// N without damping.
    normal: DMatrix<f64>,
    gradient: Vec<f64>,
    lambda: f64,
    /// See the field of [`Fitted`] with the same name.
    is_settled: bool,
}

impl<'a, 'b> Descent<'a, 'b> {
    fn new(
        compare: &'a Comparison<'b>,
        stages: &'a [usize],
        mut model: Model,
        near: Option<Vec<f64>>,
        holds_forms: bool,
    ) -> Result<Self, GapError> {
        let mut coordinates = coordinates(compare.simulator(), stages, &model);
        coordinates.retain(|(c, _)| !(holds_forms && c.is_form()));
        for (c, b) in &coordinates {
            let x = c.read(&model);
            c.write(&mut model, x.clamp(b[0], b[1]));
        }
        let n = coordinates.len();
        let mut descent = Self {
            compare,
            stages,
            residuals: Vec::new(),
            cost: f64::INFINITY,
            columns: vec![Vec::new(); n],
            normal: DMatrix::zeros(n, n),
            gradient: vec![0.0; n],
            lambda: 1e-3,
            is_settled: false,
            coordinates,
            model,
            near,
        };
        descent.residuals = descent.residuals_of(&descent.model)?;
        descent.cost = descent.cost_of(&descent.model, &descent.residuals);
        Ok(descent)
    }

    fn residuals_of(&self, model: &Model) -> Result<Vec<Column>, GapError> {
        let wanted: Vec<(usize, &Model)> = self.stages.iter().map(|&s| (s, model)).collect();
        let values = self.compare.residuals_of(&wanted, self.near.as_deref());
        let columns = self.stages.iter().zip(values);
        columns.map(|(&s, v)| Ok(self.compare.metrics[s].column(&self.compare.roles, v?))).collect()
    }

    /// Returns J of the module documentation.
    fn cost_of(&self, model: &Model, residuals: &[Column]) -> f64 {
        cost(self.compare, (self.stages, &self.coordinates), model, residuals)
    }

    /// Computes the sensitivities that are out of date again, then N and g of the module documentation.
    fn linearise(
        &mut self,
        known: &[Option<Sensitivities>],
        is_first: bool,
        renew: bool,
    ) -> Result<(), GapError> {
        let is_known = is_first && !known.is_empty();
        let mut due = Vec::new();
        for (i, place) in self.coordinates.iter().enumerate() {
            match place.0 {
                Coordinate::Nominal { index, .. } if is_known => {
                    let of = |&s: &usize| {
                        let own = known.get(s).and_then(Option::as_ref)?;
                        own.iter().find(|(p, _)| *p == index).map(|(_, c)| c.clone())
                    };
                    self.columns[i] = self.stages.iter().map(of).collect();
                }
                Coordinate::Nominal { .. } if !renew => {}
                _ if !renew && !is_first && self.is_costly(place.0) => {}
                _ => due.push(i),
            }
        }
        let places: Vec<_> = due.iter().map(|&i| self.coordinates[i]).collect();
        let at = (&self.model, self.residuals.as_slice());
        let near = self.near.as_deref().unwrap_or(&self.model.parameters);
        let columns = self.compare.sensitivities(self.stages, &places, at, near)?;
        for (i, column) in due.into_iter().zip(columns) {
            self.columns[i] = column;
        }
        self.normal_equations();
        Ok(())
    }

    /// Whether a coordinate belongs to an effect that needs a costly run for every parameter value.
    fn is_costly(&self, coordinate: Coordinate) -> bool {
        match coordinate {
            Coordinate::Nominal { .. } => false,
            Coordinate::Linear { slot, .. } | Coordinate::Log { slot, .. } => {
                self.compare.simulator().is_costly(self.model.effects[slot].0)
            }
        }
    }

    fn normal_equations(&mut self) {
        let n = self.coordinates.len();
        let weight = self.compare.weight();
        for i in 0..n {
            for j in 0..=i {
                let mut sum = 0.0;
                for (s, &stage) in self.stages.iter().enumerate() {
                    if let (Some(a), Some(b)) = (&self.columns[i][s], &self.columns[j][s]) {
                        sum += self.compare.product(stage, a, b);
                    }
                }
                self.normal[(i, j)] = weight * sum;
                self.normal[(j, i)] = self.normal[(i, j)];
            }
            self.gradient[i] = 0.0;
            for (s, &stage) in self.stages.iter().enumerate() {
                if let Some(a) = &self.columns[i][s] {
                    let product = self.compare.product(stage, a, &self.residuals[s]);
                    self.gradient[i] -= weight * product;
                }
            }
            let c = self.coordinates[i].0;
            let prior = c.prior(c.read(&self.model));
            self.gradient[i] += prior.slope;
            self.normal[(i, i)] += prior.curvature;
        }
    }

    /// Takes one step downhill with as little damping as possible. Returns whether the cost fell.
    fn step(&mut self) -> Result<bool, GapError> {
        let n = self.coordinates.len();
        let x: Vec<f64> = self.coordinates.iter().map(|(c, _)| c.read(&self.model)).collect();
        let reach = |i: usize| {
            let (c, bounds) = self.coordinates[i];
            [(bounds[0] - x[i]).max(-c.stride()), (bounds[1] - x[i]).min(c.stride())]
        };
        let (low, high): (Vec<f64>, Vec<f64>) = (0..n).map(reach).map(|[l, h]| (l, h)).unzip();
        let is_counted = self.compare.simulator().model_runs().is_some();
        for _ in 0..TRIES {
            let mut damped = self.normal.clone();
            for i in 0..n {
                damped[(i, i)] += self.lambda * self.normal[(i, i)] + RIDGE;
            }
            let step = boxed(&damped, &self.gradient, &low, &high);
            // If runs are counted, do not spend one on a step that, according to the linearised
            // model, gains nothing.
            if is_counted && self.predicted_fall(&step) < LEAST_GAIN.0 + LEAST_GAIN.1 * self.cost {
                return Ok(false);
            }
            let mut next = self.model.clone();
            for (((c, _), x), s) in self.coordinates.iter().zip(&x).zip(&step) {
                c.write(&mut next, x + s);
            }
            // If these values cannot be simulated, try a shorter step.
            if let Some(there) = if_possible(self.residuals_of(&next))? {
                let cost = self.cost_of(&next, &there);
                if cost < self.cost {
                    (self.model, self.residuals, self.cost) = (next, there, cost);
                    self.lambda = (0.2 * self.lambda).max(1e-7);
                    return Ok(true);
                }
            }
            self.lambda = (8.0 * self.lambda).max(1e-4);
        }
        Ok(false)
    }

    /// Returns the fall of the cost that the linearised residuals predict for a step d: -(g'd + d'N
    /// d/2).
    fn predicted_fall(&self, step: &[f64]) -> f64 {
        let d = DVector::from_column_slice(step);
        let slope: f64 = self.gradient.iter().zip(step).map(|(g, s)| g * s).sum();
        -(slope + 0.5 * d.dot(&(&self.normal * &d)))
    }

    /// Computes the misfits, and how precisely the parameters are known.
    fn finish(mut self) -> Fitted {
        let stages = self.stages.iter().zip(&self.residuals);
        let misfits = stages.map(|(&s, r)| self.compare.misfit(s, r)).collect();
        self.normal_equations();
        let spread = Spread::of(&Equations {
            coordinates: &self.coordinates,
            model: &self.model,
            normal: &self.normal,
            gradient: &self.gradient,
            weight: self.compare.weight(),
            noise: self.near.is_none().then(|| self.gradient_noise()),
        });
        let Self { model, cost, coordinates, normal, is_settled, .. } = self;
        Fitted { model, cost, misfits, spread, coordinates, normal, is_settled }
    }

    /// Returns the covariance of A'V^-1 r according to the residual, over all stages.
    fn gradient_noise(&self) -> DMatrix<f64> {
        let (compare, roles) = (self.compare, &self.compare.roles);
        let n = self.coordinates.len();
        let mut sum = DMatrix::zeros(n, n);
        for (s, (&stage, residual)) in self.stages.iter().zip(&self.residuals).enumerate() {
            let clean = compare.clean(stage, &residual.values);
            let fitted = roles.of_role(Role::Fit).filter(|segment| segment.to <= clean.len());
            let blocks = fitted.flat_map(|segment| {
                let starts = (segment.from..segment.to).step_by(roles.block);
                starts.map(|from| from..segment.to.min(from + roles.block))
            });
            let blocks: Vec<Range<usize>> = blocks.collect();
            let columns = self.columns.iter().map(|own| Some(&own.get(s)?.as_ref()?.values[..]));
            let columns: Vec<_> = columns.collect();
            let measured = compare.metrics[stage].measured(roles, Role::Fit);
            sum += gradient_noise(&columns, &clean, &blocks, measured);
        }
        sum
    }
}
