//! The metric of one stage: the covariance by which residuals are weighed. Residuals are in
//! multiples of the noise, and nuisances (slow drift and offsets) are marginalised.
//!
//! Within one segment of the recording, the residual r has the covariance V of
//! [`nuisance`](crate::fit::nuisance): white noise of variance 1, and the changes that slow drift
//! and offsets of parameters may cause. Segments are independent, so that the squared Mahalanobis
//! length of a residual, its chi-square, is
//!
//! ```text
//! chi^2 = sum over segments of r' V^-1 r
//! ```
//!
//! Products x'V^-1 y of sensitivities are the elements of the normal equations of every fit. The
//! nuisances are a model discrepancy as in Kennedy and O'Hagan (2001, doi 10.1111/1467-9868.00294),
//! but limited to changes that the simulator's own parameters could cause.

use std::sync::Arc;

use crate::{
    fit::{
        noise_level::NoiseLevel,
        nuisance::{Nuisance, Part},
    },
    numerics::linear::dot,
    problem::{
        error::GapError,
        runs::Runs,
        sample_roles::{Role, SampleRoles, Segment},
        simulator::Model,
        spec::SlowDrift,
    },
};

/// The metric of one stage.
#[derive(Debug, Clone)]
pub(crate) struct Metric {
    /// Standard deviation of the noise, one value per sample.
    pub(crate) noise: NoiseLevel,
    /// Parameters of the stage that drift or are offset in each trial.
    loose: Vec<Loose>,
    /// Sample time, s.
    dt_s: f64,
    /// The nuisance of each segment; `None` if no parameter of the stage is loose.
    nuisances: Vec<Option<Nuisance>>,
}

/// A loose parameter, i.e. one that drifts or has an offset in each trial; or the recorder, if it
/// may drift.
#[derive(Debug, Clone)]
pub(crate) struct Loose {
    /// Index of the parameter; `None` for the recorder.
    pub(crate) parameter: Option<usize>,
    /// Change of the output, in multiples of the noise, if the parameter changes by one standard
    /// deviation of its drift or offset in the simulator's description.
    column: Arc<[f64]>,
    /// See [`RecordFacts::drift_clocks`](crate::RecordFacts::drift_clocks).
    clock: Arc<[u32]>,
    /// The slow drift of the parameter as the simulator describes it; none for an offset.
    pub(crate) drift: Option<SlowDrift>,
    /// Whether there is a separate offset for each tick of the clock, with the size in the
    /// simulator's description.
    pub(crate) is_by_tick: bool,
    /// Assumed size and correlation time of the drift or offset.
    pub(crate) level: Level,
}

/// Size of a nuisance, as a multiple of the size in the simulator's description (0 for no
/// nuisance), and its correlation time, s (meaningless for an offset).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Level {
    pub(crate) size: f64,
    pub(crate) time_s: f64,
}

impl Level {
    /// No nuisance.
    pub(crate) const NONE: Self = Self { size: 0.0, time_s: 1.0 };
}

/// A residual or a sensitivity over whole segments, in multiples of the noise, prepared for
/// products in the metric.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    pub(crate) values: Vec<f64>,
    /// By segment: the values whitened by [`nuisance`](crate::fit::nuisance); `None` without a
    /// nuisance.
    whitened: Vec<Option<Vec<f64>>>,
}

impl Metric {
    /// Computes the metric of a stage around a model. The sensitivities of the stage to its loose
    /// parameters determine which part of a residual the nuisances can explain. The nuisances have
    /// the sizes in the simulator's description, or those of `like`, if given.
    pub(crate) fn of(
        runs: &Runs<'_>,
        roles: &SampleRoles,
        stage: usize,
        noise: NoiseLevel,
        model: &Model,
        like: Option<&Self>,
    ) -> Result<Self, GapError> {
        let simulator = runs.simulator();
        let specs = simulator.parameters();
        let sd = |p: usize| {
            let spec = &specs[p];
            spec.drift.map(|w| w.sd).or(spec.per_trial_sd).or(spec.per_tick_sd)
        };
        let is_loose = |p: &usize| sd(*p).is_some();
        let own = simulator.stages()[stage].parameters.iter().copied();
        let parameters: Vec<usize> = own.filter(is_loose).collect();
        let dt_s = simulator.dt_s();
        let mut metric = Self { noise, loose: Vec::new(), dt_s, nuisances: Vec::new() };
        let trials = simulator.trials();
        let always = || trials.iter().flat_map(|t| 0..t.samples as u32).collect::<Vec<u32>>();
        // The recorder comes first, so that its index does not depend on the parameters.
        if let Some(drift) = simulator.stages()[stage].recorder_drift {
            let column =
                metric.noise.sd.iter().map(|sd| if sd.is_finite() { drift.sd } else { 0.0 });
            let (column, clock) = (column.collect(), always());
            let (parameter, clock, drift) = (None, clock.into(), Some(drift));
            let (level, is_by_tick) = (Level::NONE, false);
            metric.loose.push(Loose { parameter, column, clock, drift, is_by_tick, level });
        }
        let plain = match parameters.is_empty() {
            true => Vec::new(),
            false => runs.output(stage, model, trials.len())?,
        };
        for &p in &parameters {
            let spec = &specs[p];
            let mut moved = model.clone();
            moved.parameters[p] += sd(p).unwrap_or(0.0);
            let mut column = runs.output(stage, &moved, trials.len())?;
            for ((x, y), sd) in column.iter_mut().zip(&plain).zip(&metric.noise.sd) {
                *x = (*x - y) / sd;
            }
            let clock = simulator.record().drift_clock(p).map_or_else(always, <[u32]>::to_vec);
            let level = Level { size: 1.0, time_s: spec.drift.map_or(1.0, |w| w.correlation_s) };
            let is_by_tick = spec.per_tick_sd.is_some();
            let (column, clock) = (column.into(), clock.into());
            let drift = spec.drift;
            let parameter = Some(p);
            metric.loose.push(Loose { parameter, column, clock, drift, is_by_tick, level });
        }
        if let Some(like) = like {
            let pairs = metric.loose.iter_mut().zip(&like.loose);
            pairs.for_each(|(own, other)| own.level = other.level);
        }
        metric.marginalise(roles, |_| true);
        Ok(metric)
    }

    /// Recomputes the nuisances of all segments from the levels of the loose parameters.
    fn marginalise(&mut self, roles: &SampleRoles, is_used: impl Fn(&Segment) -> bool) {
        let loose = || self.loose.iter().filter(|loose| loose.level.size > 0.0);
        let one = |segment: &Segment| {
            let range = segment.from..segment.to;
            if !is_used(segment) {
                return None;
            }
            let part = |loose: &Loose| {
                let Level { size, time_s } = loose.level;
                let clock = &loose.clock[range.clone()];
                let kept = |passed: u32| match (loose.drift, loose.is_by_tick) {
                    (_, true) => f64::from(passed == 0),
                    (Some(_), _) => (-self.dt_s * f64::from(passed) / time_s).exp(),
                    (None, _) => 1.0,
                };
                // Most steps of a clock are equally long, and exponentials take long.
                let (mut last, mut share) = (0, kept(0));
                let before = clock.first().into_iter().chain(clock);
                let passed = clock.iter().zip(before).map(|(now, before)| now - before);
                let kept = passed.map(|passed| {
                    if passed != last {
                        (last, share) = (passed, kept(passed));
                    }
                    share
                });
                let column = loose.column[range.clone()].iter().map(|x| size * x).collect();
                Part { column, kept: kept.collect() }
            };
            let parts: Vec<Part> = loose().map(part).collect();
            (!parts.is_empty()).then(|| Nuisance::new(&parts))
        };
        self.nuisances = roles.segments.iter().map(one).collect();
    }

    /// Parameters of the stage that drift or are offset in each trial.
    pub(crate) fn loose(&self) -> &[Loose] {
        &self.loose
    }

    /// Standard deviation of the recorder's drift, in multiples of the noise, and its correlation time, s; `None` without a drift.
    pub(crate) fn recorder_drift(&self) -> Option<(f64, f64)> {
        let own =
            self.loose.iter().find(|loose| loose.parameter.is_none() && loose.level.size > 0.0)?;
        Some((own.drift?.sd * own.level.size, own.level.time_s))
    }

    /// Returns the metric with another level for every loose parameter.
    pub(crate) fn with(&self, level: impl Fn(usize, Level) -> Level, roles: &SampleRoles) -> Self {
        let mut other = self.leveled(level);
        other.marginalise(roles, |_| true);
        other
    }

    /// Like [`Metric::with`], but for the samples that are not test samples only.
    pub(crate) fn looked_at(
        &self,
        level: impl Fn(usize, Level) -> Level,
        roles: &SampleRoles,
    ) -> Self {
        let mut other = self.leveled(level);
        other.marginalise(roles, |segment| segment.role != Role::Test);
        other
    }

    fn leveled(&self, level: impl Fn(usize, Level) -> Level) -> Self {
        let (noise, loose) = (self.noise.clone(), self.loose.clone());
        let mut other = Self { noise, loose, dt_s: self.dt_s, nuisances: Vec::new() };
        let each = other.loose.iter_mut().enumerate();
        each.for_each(|(i, loose)| loose.level = level(i, loose.level));
        other
    }

    /// Returns a column of values, in multiples of the noise, that cover the first trials.
    pub(crate) fn column(&self, roles: &SampleRoles, values: Vec<f64>) -> Column {
        let one = |(segment, nuisance): (&Segment, &Option<Nuisance>)| {
            let nuisance = nuisance.as_ref().filter(|_| segment.to <= values.len())?;
            Some(nuisance.whitened(&values[segment.from..segment.to]))
        };
        let whitened = roles.segments.iter().zip(&self.nuisances).map(one).collect();
        Column { values, whitened }
    }

    /// Returns x'V^-1 y over the segments in a role.
    pub(crate) fn product(&self, roles: &SampleRoles, x: &Column, y: &Column, role: Role) -> f64 {
        let mut sum = 0.0;
        for (i, segment) in roles.segments.iter().enumerate() {
            if segment.role != role || segment.to > x.values.len() {
                continue;
            }
            let range = segment.from..segment.to;
            sum += match (&x.whitened[i], &y.whitened[i]) {
                (Some(x), Some(y)) => dot(x, y),
                _ => dot(&x.values[range.clone()], &y.values[range]),
            };
        }
        sum
    }

    /// Returns the number of samples in a role that count. Samples that were not measured and
    /// isolated outliers, whose noise is infinite, do not count.
    pub(crate) fn measured(&self, roles: &SampleRoles, role: Role) -> usize {
        let own = roles.of_role(role).flat_map(|s| &self.noise.sd[s.from..s.to]);
        own.filter(|sd| sd.is_finite()).count()
    }

    /// Returns ln det V, summed over the segments in a role.
    pub(crate) fn ln_det(&self, roles: &SampleRoles, role: Role) -> f64 {
        let pairs = roles.segments.iter().zip(&self.nuisances).filter(|(s, _)| s.role == role);
        pairs.filter_map(|(_, nuisance)| Some(nuisance.as_ref()?.ln_determinant())).sum()
    }

    /// Returns 2 sum ln s over the samples in a role, with the noise s of each sample. Added to ln
    /// det V, it gives the determinant in the unit of the output.
    pub(crate) fn ln_noise(&self, roles: &SampleRoles, role: Role) -> f64 {
        let own = roles.segments.iter().filter(|s| s.role == role);
        let sds = own.flat_map(|s| &self.noise.sd[s.from..s.to]).filter(|sd| sd.is_finite());
        2.0 * sds.map(|sd| sd.ln()).sum::<f64>()
    }

    /// Subtracts the most likely nuisances from a residual in multiples of the noise.
    pub(crate) fn clean(&self, roles: &SampleRoles, values: &mut [f64]) {
        for (segment, nuisance) in roles.segments.iter().zip(&self.nuisances) {
            if let Some(nuisance) = nuisance.as_ref().filter(|_| segment.to <= values.len()) {
                nuisance.clean(&mut values[segment.from..segment.to]);
            }
        }
    }
}

#[cfg(test)]
impl Metric {
    /// Returns a metric with one parameter that drifts in one trial.
    pub(crate) fn with_drift(
        noise: NoiseLevel,
        column: Vec<f64>,
        drift: SlowDrift,
        roles: &SampleRoles,
        dt_s: f64,
    ) -> Self {
        let clock: Arc<[u32]> = (0..column.len() as u32).collect();
        let column = column.into();
        let level = Level { size: 1.0, time_s: drift.correlation_s };
        let drift = Some(drift);
        let is_by_tick = false;
        let loose = vec![Loose { parameter: Some(0), column, clock, drift, is_by_tick, level }];
        let mut metric = Self { noise, loose, dt_s, nuisances: Vec::new() };
        metric.marginalise(roles, |_| true);
        metric
    }
}
