//! Compares a simulator with its measurements. Every stage is driven by its measured input, and its
//! residual is measured in its own metric.

use std::sync::Arc;

use rayon::prelude::*;

use crate::{
    fit::{
        alike::{Errors, Read},
        coordinate::{Coordinate, coordinates},
        metric::{Column, Metric},
        motion::depends_on_motion,
        noise_level::noise_levels,
        octaves::Octaves,
        score::{Misfit, samples_per_observation},
    },
    numerics::linear::dot,
    problem::{
        error::{GapError, if_possible},
        runs::Runs,
        sample_roles::{Role, SampleRoles},
        simulator::{Model, Run, Simulator},
        spec::EffectSpec,
    },
};

/// Number of draws of the measured input's noise. They are the same for every model, so that models
/// do not differ by chance.
const DRAWS: u64 = 4;

/// A simulator and its measurements, with the metric of every stage.
#[derive(Clone)]
pub(crate) struct Comparison<'a> {
    pub(crate) runs: Runs<'a>,
    pub(crate) roles: SampleRoles,
    /// The metric of each stage.
    pub(crate) metrics: Vec<Metric>,
}

/// Sensitivities of one stage's output to its nominal parameters, each with the index of the
/// parameter.
pub(crate) type Sensitivities = Vec<(usize, Column)>;

impl<'a> Comparison<'a> {
    /// Computes noise and metrics around a model. If `like` is given, the nuisances have the sizes
    /// and correlation times of those metrics.
    pub(crate) fn around(
        runs: Runs<'a>,
        roles: SampleRoles,
        model: &Model,
        like: Option<&[Metric]>,
        seed: u64,
    ) -> Result<Self, GapError> {
        let levels = noise_levels(&runs, &roles, model, seed)?;
        let levels: Vec<_> = levels.into_iter().enumerate().collect();
        let metrics: Result<Vec<Metric>, GapError> = levels
            .into_par_iter()
            .map(|(stage, noise)| {
                Metric::of(&runs, &roles, stage, noise, model, like.map(|l| &l[stage]))
            })
            .collect();
        Ok(Self { metrics: metrics?, runs, roles })
    }

    /// Re-estimates sizes and correlation times of the nuisances from the residual of a model.
    /// Returns the rise of their log-likelihood, nats.
    pub(crate) fn adapt(&mut self, model: &Model) -> Result<f64, GapError> {
        let mut gained = 0.0;
        for stage in 0..self.metrics.len() {
            if !self.metrics[stage].loose().is_empty() {
                let output = self.runs.run(self.run_of(stage, model, None))?;
                let residual = self.apart(stage, output.clone());
                let dt_s = self.simulator().dt_s();
                let moves = |left: &[f64]| depends_on_motion(&self.roles, left, &output, dt_s);
                let (metric, more) = self.metrics[stage].adapted(&self.roles, &residual, moves);
                self.metrics[stage] = metric;
                gained += more;
            }
        }
        Ok(gained)
    }

    /// The same session with another simulator, and its own copy of the metrics.
    pub(crate) fn beside<'b>(
        &self,
        simulator: &'b dyn Simulator,
        metrics: Vec<Metric>,
    ) -> Comparison<'b>
    where
        'a: 'b,
    {
        Comparison { runs: self.runs.beside(simulator), roles: self.roles.clone(), metrics }
    }

    pub(crate) fn simulator(&self) -> &'a dyn Simulator {
        self.runs.simulator()
    }

    /// Returns the weight of a sample in the cost of a fit. A block of samples counts as one
    /// observation, whatever the correlation time of the residual is.
    pub(crate) fn weight(&self) -> f64 {
        1.0 / self.roles.block as f64
    }

    /// Returns measured minus simulated output, in multiples of the noise, over the trials that
    /// fits use.
    pub(crate) fn residual_values(
        &self,
        stage: usize,
        model: &Model,
    ) -> Result<Vec<f64>, GapError> {
        let values = self.runs.run(self.run_of(stage, model, None))?;
        Ok(self.apart(stage, values))
    }

    /// Returns the run of a stage over the trials that fits use. The simulator may answer it from a
    /// linearisation around the parameters `near`.
    fn run_of<'m>(&self, stage: usize, model: &'m Model, near: Option<&'m [f64]>) -> Run<'m> {
        Run { near, ..Run::exact(stage, model, self.roles.fit_trials) }
    }

    /// Returns measured minus simulated output, in multiples of the noise.
    pub(crate) fn apart(&self, stage: usize, mut values: Vec<f64>) -> Vec<f64> {
        let measured = self.simulator().measured(stage);
        for ((x, m), sd) in values.iter_mut().zip(measured).zip(&self.metrics[stage].noise.sd) {
            *x = (m - *x) / sd;
        }
        values
    }

    /// Computes [`Comparison::residual_values`] of some pairs of a stage and a model, in one batch.
    pub(crate) fn residuals_of(
        &self,
        wanted: &[(usize, &Model)],
        near: Option<&[f64]>,
    ) -> Vec<Result<Vec<f64>, GapError>> {
        let runs: Vec<Run<'_>> =
            wanted.iter().map(|(stage, model)| self.run_of(*stage, model, near)).collect();
        let outputs = self.runs.run_many(&runs).into_iter().zip(wanted);
        outputs.map(|(output, (stage, _))| Ok(self.apart(*stage, output?))).collect()
    }

    /// Computes [`Comparison::residual_values`] of every model in every stage, in one batch; `None`
    /// for a model that cannot be simulated.
    pub(crate) fn possible_residuals(
        &self,
        stages: &[usize],
        models: &[Model],
    ) -> Result<Vec<Option<Vec<Vec<f64>>>>, GapError> {
        let wanted: Vec<(usize, &Model)> =
            models.iter().flat_map(|model| stages.iter().map(move |&s| (s, model))).collect();
        let mut there = self.residuals_of(&wanted, None).into_iter();
        let one = |_| {
            // Take all residuals of a model from the iterator, even if one of them failed.
            let own: Vec<Result<Vec<f64>, GapError>> = there.by_ref().take(stages.len()).collect();
            if_possible(own.into_iter().collect())
        };
        models.iter().map(one).collect()
    }

    /// Returns measured minus simulated output, in multiples of the noise, prepared for products in
    /// the metric.
    pub(crate) fn residual(&self, stage: usize, model: &Model) -> Result<Column, GapError> {
        let values = self.residual_values(stage, model)?;
        Ok(self.metrics[stage].column(&self.roles, values))
    }

    /// Returns x'V^-1 y of a stage over the fitted samples.
    pub(crate) fn product(&self, stage: usize, x: &Column, y: &Column) -> f64 {
        self.metrics[stage].product(&self.roles, x, y, Role::Fit)
    }

    /// Returns the reduced chi-squares of a residual, not yet corrected to
    /// [equal transmitted noise](Misfit::at_equal_noise).
    pub(crate) fn misfit(&self, stage: usize, residual: &Column) -> Misfit {
        let mean = |role| {
            let n = self.metrics[stage].measured(&self.roles, role) as f64;
            let sum = self.metrics[stage].product(&self.roles, residual, residual, role);
            if n > 0.0 { sum / n } else { 1.0 }
        };
        let octaves = self.octaves(stage, &residual.values);
        let read = self.is_read(stage).then(|| {
            let left = self.errors(stage, &residual.values);
            Read { unread: Arc::clone(&left), left }
        });
        Misfit { stage, fit: mean(Role::Fit), held: mean(Role::Held), octaves, read }
    }

    /// Whether an effect of the catalogue reads the measured output of this stage, or reads another
    /// output and changes this stage.
    fn is_read(&self, stage: usize) -> bool {
        let reads =
            |e: &EffectSpec| e.reads.is_some_and(|s| s == stage || e.touches.contains(&stage));
        self.simulator().effects().iter().any(reads)
    }

    /// Returns a residual without its nuisances, over the fitted and over the held-out samples.
    pub(super) fn errors(&self, stage: usize, residual: &[f64]) -> Arc<Errors> {
        let clean = self.clean(stage, residual);
        let of = |role| {
            let own = self.roles.of_role(role).flat_map(|s| &clean[s.from..s.to]);
            own.map(|x| *x as f32).collect()
        };
        Arc::new(Errors { fit: of(Role::Fit), held: of(Role::Held) })
    }

    /// Returns the reduced chi-square over fitted and held-out samples together.
    pub(crate) fn mean_square(&self, misfit: &Misfit) -> f64 {
        let (fit, held) = (self.roles.blocks(Role::Fit), self.roles.blocks(Role::Held));
        (fit * misfit.fit + held * misfit.held) / (fit + held)
    }

    /// Returns how many samples of a stage count as one observation of the misfit of a model.
    pub(crate) fn samples_per_observation(
        &self,
        stage: usize,
        model: &Model,
    ) -> Result<f64, GapError> {
        let residual = self.residual_values(stage, model)?;
        Ok(self.memory(&self.clean(stage, &residual)))
    }

    /// Returns how many samples of a residual without nuisances count as one observation.
    pub(crate) fn memory(&self, clean: &[f64]) -> f64 {
        let parts = self.roles.of_role(Role::Fit).map(|s| &clean[s.from..s.to]);
        samples_per_observation(&parts.collect::<Vec<_>>(), self.roles.block)
    }

    /// Returns a residual in multiples of the noise without its most likely nuisances.
    pub(crate) fn clean(&self, stage: usize, residual: &[f64]) -> Vec<f64> {
        let mut clean = residual.to_vec();
        self.metrics[stage].clean(&self.roles, &mut clean);
        clean
    }

    /// Returns the mean squares by [octaves](crate::fit::octaves) of a residual in multiples of the
    /// noise, over fitted and held-out samples.
    pub(crate) fn octaves(&self, stage: usize, residual: &[f64]) -> Octaves {
        let clean = self.clean(stage, residual);
        let mut octaves = Octaves::default();
        for s in self.roles.looked_at() {
            octaves.add(&residual[s.from..s.to], &clean[s.from..s.to]);
        }
        octaves
    }

    /// Computes the transmitted noise of a stage: the mean square that the measured input's noise
    /// causes at the output, in variances of the noise.
    pub(crate) fn transmitted(&self, stage: usize, model: &Model) -> Result<Misfit, GapError> {
        let run = Run::exact(stage, model, self.roles.fit_trials);
        let undisturbed = self.runs.run(run)?;
        let mut mean = Misfit { stage, ..Misfit::default() };
        for draw in 0..DRAWS {
            let arrived = self.arrived(Run { input_noise: Some(draw), ..run }, &undisturbed)?;
            let power = |role| {
                let parts = self.roles.of_role(role).map(|s| &arrived[s.from..s.to]);
                let sum: f64 = parts.map(|part| dot(part, part)).sum();
                sum / (self.roles.count(role) as f64).max(1.0)
            };
            mean.fit += power(Role::Fit) / DRAWS as f64;
            mean.held += power(Role::Held) / DRAWS as f64;
            for s in self.roles.looked_at() {
                mean.octaves.add(&arrived[s.from..s.to], &arrived[s.from..s.to]);
            }
            if mean.fit == 0.0 {
                break;
            }
        }
        mean.octaves = mean.octaves.scaled(1.0 / DRAWS as f64);
        Ok(mean)
    }

    /// Returns the change of an output by one draw of the measured input's noise, in multiples of
    /// the noise. `undisturbed` is the output without this noise.
    pub(crate) fn arrived(&self, run: Run<'_>, undisturbed: &[f64]) -> Result<Vec<f64>, GapError> {
        let mut arrived = self.runs.run(run)?;
        let sds = &self.metrics[run.stage].noise.sd;
        for ((x, y), sd) in arrived.iter_mut().zip(undisturbed).zip(sds) {
            *x = (*x - y) / sd;
        }
        Ok(arrived)
    }

    /// Computes the sensitivities -dr/dx of the stages to some coordinates, by one-sided
    /// differences in one batch. `None` for a coordinate that does not act in the stage, or if
    /// neither a step up nor a step down can be simulated.
    ///
    /// The simulator may answer the runs with moved coordinates from a linearisation around the
    /// parameters `near`.
    pub(crate) fn sensitivities(
        &self,
        stages: &[usize],
        coordinates: &[(Coordinate, [f64; 2])],
        (model, residuals): (&Model, &[Column]),
        near: &[f64],
    ) -> Result<Vec<Vec<Option<Column>>>, GapError> {
        let moved: Vec<(f64, Model)> = coordinates
            .iter()
            .map(|(coordinate, bounds)| {
                let x = coordinate.read(model);
                let step = coordinate.probe(x);
                let step = if x + step > bounds[1] { -step } else { step };
                let mut moved = model.clone();
                coordinate.write(&mut moved, x + step);
                (step, moved)
            })
            .collect();
        let acts =
            |c: usize, s: usize| coordinates[c].0.acts_in(self.simulator(), stages[s], model);
        let places: Vec<(usize, usize)> = (0..coordinates.len())
            .flat_map(|c| (0..stages.len()).map(move |s| (c, s)))
            .filter(|&(c, s)| acts(c, s))
            .collect();
        let wanted: Vec<(usize, &Model)> =
            places.iter().map(|&(c, s)| (stages[s], &moved[c].1)).collect();
        let there = self.residuals_of(&wanted, Some(near));
        let columns = places.par_iter().zip(there).map(|(&(c, s), there)| {
            let ((coordinate, _), (step, _)) = (&coordinates[c], &moved[c]);
            let (step, there) = match if_possible(there)? {
                Some(there) => (*step, there),
                None => {
                    // A step to this side cannot be simulated: step to the other side.
                    let mut other = model.clone();
                    coordinate.write(&mut other, coordinate.read(model) - step);
                    let mut back = self.residuals_of(&[(stages[s], &other)], Some(near));
                    match if_possible(back.remove(0))? {
                        Some(back) => (-step, back),
                        None => return Ok((c, s, None)),
                    }
                }
            };
            let here = &residuals[s].values;
            let values = here.iter().zip(there).map(|(a, b)| (a - b) / step).collect();
            Ok((c, s, Some(self.metrics[stages[s]].column(&self.roles, values))))
        });
        let columns: Result<Vec<_>, GapError> = columns.collect();
        let mut out = vec![vec![None; stages.len()]; coordinates.len()];
        for (c, s, column) in columns? {
            out[c][s] = column;
        }
        Ok(out)
    }

    /// Returns the sensitivities of a stage to its nominal parameters at a model, for a change by
    /// one tolerance each.
    pub(crate) fn nominal_sensitivities(
        &self,
        stage: usize,
        model: &Model,
        residual: &Column,
    ) -> Result<Sensitivities, GapError> {
        let bare = Model { parameters: model.parameters.clone(), effects: Vec::new() };
        let own = coordinates(self.simulator(), &[stage], &bare);
        let at = (model, std::slice::from_ref(residual));
        let columns = self.sensitivities(&[stage], &own, at, &model.parameters)?;
        let pairs = own.iter().zip(columns).filter_map(|((coordinate, _), column)| {
            let Coordinate::Nominal { index, .. } = *coordinate else { return None };
            Some((index, column.into_iter().next().flatten()?))
        });
        Ok(pairs.collect())
    }
}
