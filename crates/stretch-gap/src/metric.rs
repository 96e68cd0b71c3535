//! The metric of one stage: residuals in floors, nuisances marginalised.
//!
//! Within one segment the residual r has the covariance V = I + C P^-1 C' of the [nuisance](crate::nuisance): white noise
//! of one floor, and what wander and offsets of parameters may change. Segments are independent, so that the squared Mahalanobis
//! length of a residual, its chi-square, is
//!
//! ```text
//! chi^2 = sum over segments of r' V^-1 r
//! ```
//!
//! and products x'V^-1 y of sensitivities make the normal equations of every fit. This is the generative discrepancy of
//! Kennedy and O'Hagan (2001, doi 10.1111/1467-9868.00294), confined to what the simulator's own parameters could do.

use crate::{
    error::GapError,
    floor::Floor,
    frame::{Frame, Role},
    linear::dot,
    nuisance::{Nuisance, Wandering},
    runs::Runs,
    simulator::Model,
};

/// The metric of one stage.
#[derive(Debug, Clone)]
pub(crate) struct Metric {
    /// One standard deviation of the noise, sample by sample.
    pub(crate) floor: Floor,
    /// By segment of the frame; none where no parameter of the stage wanders.
    nuisances: Vec<Option<Nuisance>>,
}

/// A residual or a sensitivity over whole segments, in floors, ready for products.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    pub(crate) values: Vec<f64>,
    /// L^-1 C'x by segment.
    tails: Vec<Vec<f64>>,
}

impl Metric {
    /// The metric of a stage around a model: its sensitivities to the parameters that wander or are offset in each trial
    /// tell what of a residual can be theirs.
    pub(crate) fn of(
        runs: &Runs<'_>,
        frame: &Frame,
        stage: usize,
        floor: Floor,
        model: &Model,
    ) -> Result<Self, GapError> {
        let simulator = runs.simulator();
        let specs = simulator.parameters();
        let is_loose = |p: &usize| specs[*p].wander.is_some() || specs[*p].per_trial_sd.is_some();
        let own = simulator.stages()[stage].parameters.iter().copied();
        let loose: Vec<usize> = own.filter(is_loose).collect();
        if loose.is_empty() {
            return Ok(Self { floor, nuisances: vec![None; frame.segments.len()] });
        }
        let trials = simulator.trials();
        let plain = runs.output(stage, model, trials.len())?;
        let mut columns = Vec::new();
        for &p in &loose {
            let spec = &specs[p];
            // Change of the output, in floors, for one standard deviation.
            let sd = spec.wander.map(|w| w.sd).or(spec.per_trial_sd).unwrap_or(0.0);
            let mut moved = model.clone();
            moved.parameters[p] += sd;
            let mut column = runs.output(stage, &moved, trials.len())?;
            for ((x, y), sd) in column.iter_mut().zip(&plain).zip(&floor.sd) {
                *x = (*x - y) / sd;
            }
            let always = || trials.iter().flat_map(|t| 0..t.samples as u32).collect();
            let clock = simulator.wander_clock(p).unwrap_or_else(always);
            if clock.len() < column.len() {
                let (name, found, needed) = (&spec.name, clock.len(), column.len());
                let what = format!("the wander clock of {name} has {found} samples of {needed}");
                return Err(GapError::simulator(what));
            }
            columns.push((spec, column, clock));
        }
        let nuisances = frame.segments.iter().map(|segment| {
            let range = segment.from..segment.to;
            let (mut offsets, mut wandering) = (Vec::new(), Vec::new());
            for (spec, column, clock) in &columns {
                let part = column[range.clone()].to_vec();
                match spec.wander {
                    Some(wander) => {
                        let clock = &clock[range.clone()];
                        wandering.push(Wandering::new(part, clock, wander, simulator.dt_s()));
                    }
                    None => offsets.push(part),
                }
            }
            Some(Nuisance::new(offsets, wandering))
        });
        Ok(Self { nuisances: nuisances.collect(), floor })
    }

    /// A column of values in floors over the first trials.
    pub(crate) fn column(&self, frame: &Frame, values: Vec<f64>) -> Column {
        let tails = frame
            .segments
            .iter()
            .zip(&self.nuisances)
            .map(|(segment, nuisance)| match nuisance {
                Some(nuisance) if segment.to <= values.len() => {
                    nuisance.tail(&values[segment.from..segment.to])
                }
                _ => Vec::new(),
            })
            .collect();
        Column { values, tails }
    }

    /// x'V^-1 y over the segments in a role.
    pub(crate) fn product(&self, frame: &Frame, x: &Column, y: &Column, role: Role) -> f64 {
        let mut sum = 0.0;
        for (i, segment) in frame.segments.iter().enumerate() {
            if segment.role != role || segment.to > x.values.len() {
                continue;
            }
            let range = segment.from..segment.to;
            sum += dot(&x.values[range.clone()], &y.values[range]);
            sum -= dot(&x.tails[i], &y.tails[i]);
        }
        sum
    }

    /// ln det V + 2 sum ln s over the segments in a role: the normaliser of the residual's density, floors s.
    pub(crate) fn ln_det(&self, frame: &Frame, role: Role) -> f64 {
        let pairs = frame.segments.iter().zip(&self.nuisances).filter(|(s, _)| s.role == role);
        pairs
            .map(|(segment, nuisance)| {
                let floors = self.floor.sd[segment.from..segment.to].iter();
                nuisance.as_ref().map_or(0.0, Nuisance::ln_det)
                    + 2.0 * floors.map(|sd| sd.ln()).sum::<f64>()
            })
            .sum()
    }

    /// Takes the most likely nuisances out of a residual in floors.
    pub(crate) fn clean(&self, frame: &Frame, values: &mut [f64]) {
        for (segment, nuisance) in frame.segments.iter().zip(&self.nuisances) {
            if let Some(nuisance) = nuisance.as_ref().filter(|_| segment.to <= values.len()) {
                nuisance.clean(&mut values[segment.from..segment.to]);
            }
        }
    }
}
