//! Detection limits: how strong each effect would have to be to be named on these data.
//!
//! Assume that the re-tuned nominal simulator is true, that the residual of the best set of effects
//! is noise, and that the rig has one more effect of the strength s. A *probe* is a simulation with
//! this effect at a strength s_0. The effect changes the output by d(s), of which the nominal
//! parameters cannot compensate the part u:
//!
//! ```text
//! d(s) = (s/s_0)^(p/2) d(s_0),     u = d - A (A'V^-1 A + b I)^-1 A'V^-1 d
//! ```
//!
//! V is the [metric](crate::fit::metric) of every fit and A the sensitivities to the nominal
//! parameters, whose prior has precision 1; a block of b samples counts as one observation. If the
//! change is linear in the strength, p is 2. The verdict depends on scores, on residuals of the
//! fitted and the test trials, and on probabilities compared with alternatives. All of these depend
//! on the noise n only through |n|^2 and a few products u_j'V^-1 n, one per effect j that is
//! compared. These products are normal, and their covariance is the Gram matrix u_i'V^-1 u_j.
//! Therefore the products are drawn instead of time series. Each draw stands for one recording. The
//! share of these recordings in which the rule of the [posterior](crate::evidence::probability)
//! names the effect is its power (Neyman and Pearson 1933, doi 10.1098/rsta.1933.0009). The
//! detection limit is the strength at which the power is 0.9.
//!
//! A *start* is one of the parameter values at which a fit of the effect begins. The effect's other
//! parameters have the values of the start from which it is detected most easily. Each alternative
//! is probed at up to two of its starts. The power law holds only near the probe, because an effect
//! may have a kink. Therefore, if a limit is far from its probe, the effect is probed again at the
//! limit, and p is computed from the last two probes.

mod draws;
mod lags;
mod probes;

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::{
    draws::Record,
    probes::{Probes, Start, easiest, sizes},
};
use crate::{
    fit::{hypothesis::Hypothesis, prepared::PreparedProblem},
    problem::{error::GapError, spec::EffectSpec, thresholds::Thresholds},
    search::selection::Looked,
};

/// Number of bisection steps after a limit is bracketed within the ratio [`STEP`]. They determine the limit with an
/// accuracy of 1 %.
const HALVINGS: usize = 6;
/// Strengths below this share of the range are not tried.
const LEAST: f64 = 1e-6;
/// A limit is searched up to the share [`INSIDE`] of the range. To bracket it, strengths are tried
/// in ratios of [`STEP`].
const INSIDE: f64 = 0.99;
const STEP: f64 = 1.5;
/// If the ratio of a limit to its probe exceeds [`FAR`], the effect is probed again, at most
/// [`ROUNDS`] times.
const FAR: f64 = 1.4;
const ROUNDS: usize = 4;

/// Smallest strength of an effect that would be named on these data.
///
/// ```
/// let limit: stretch_gap::DetectionLimit =
///     serde_json::from_str(r#"{ "effect": "leak", "parameter": "g", "strength": null, "unit": "1/s" }"#)?;
/// assert_eq!(limit.strength, None); // these data do not show it at any strength that makes sense
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DetectionLimit {
    /// Effect.
    pub effect: String,
    /// Parameter that is its strength.
    pub parameter: String,
    /// Value of the parameter at which the effect would be named with probability 0.9 if the
    /// re-tuned nominal simulator were otherwise true. A fit of an effect begins at several sets of
    /// values, its starts. The effect's other parameters have the values of the start at which the
    /// effect is easiest to detect. `None` if no value within its range would be named.
    pub strength: Option<f64>,
    /// Unit of the value.
    pub unit: String,
    /// Values of the other parameters.
    #[serde(default)]
    pub others: BTreeMap<String, f64>,
}

/// Inputs of the computation of detection limits. The residual of the best set is taken for noise,
/// and the thresholds define the rule by which effects are named.
#[derive(Clone, Copy)]
pub(crate) struct LimitInputs<'a> {
    pub(crate) problem: &'a PreparedProblem<'a>,
    pub(crate) best: &'a Hypothesis,
    pub(crate) thresholds: &'a Thresholds,
    /// Excess below which noise alone stays in 19 of 20 recordings.
    pub(crate) null_band: f64,
    pub(crate) seed: u64,
}

/// Returns the detection limit of every effect, in the order of the catalogue. Effects whose course
/// in time is estimated from the recording have no strength and are left out. `looked` holds the
/// results of a screening around the re-tuned nominal simulator, if there was one.
pub(crate) fn detection_limits(
    inputs: LimitInputs<'_>,
    looked: Option<&Looked>,
) -> Result<Vec<DetectionLimit>, GapError> {
    let problem = inputs.problem;
    let sizes = sizes(problem, looked)?;
    let starts: Vec<Vec<Start>> =
        sizes.into_iter().enumerate().map(|(e, own)| easiest(problem, e, own, inputs)).collect();
    let mut probes = Probes::of(problem, inputs.best, &starts)?;
    let mut found = limits(inputs, &probes)?;
    // If a limit is far from its probe, the effect is probed again at the strength of the limit. If
    // runs are costly, the first probe has to suffice.
    let rounds = if problem.simulator().model_runs().is_none() { ROUNDS } else { 0 };
    for _ in 0..rounds {
        let moved = probes.moved(problem, &found, FAR)?;
        if moved.is_empty() {
            break;
        }
        let again = moved.into_par_iter().map(|e| Ok((e, limit(inputs, &probes, e)?)));
        for (e, limit) in again.collect::<Result<Vec<_>, GapError>>()? {
            found[e] = limit;
        }
    }
    let effects = problem.simulator().effects().iter().enumerate().zip(found);
    let effects = effects.filter(|((_, spec), _)| !spec.is_found);
    let limit = |((effect, spec), strength): ((usize, &EffectSpec), Option<f64>)| {
        let start = probes.first(effect).map(|own| &probes.all[own].start);
        let main = start.map_or(0, |start| start.main);
        let parameter = &spec.parameters[main];
        let values = spec.parameters.iter().zip(start.map_or(&[][..], |start| &start.values));
        let others = values.enumerate().filter(|(i, _)| *i != main);
        DetectionLimit {
            others: others.map(|(_, (p, value))| (p.name.to_string(), *value)).collect(),
            effect: spec.name.clone(),
            parameter: parameter.name.to_string(),
            strength,
            unit: parameter.unit.to_string(),
        }
    };
    Ok(effects.map(limit).collect())
}

/// Returns the limit of every effect, computed from its probe.
fn limits(inputs: LimitInputs<'_>, probes: &Probes) -> Result<Vec<Option<f64>>, GapError> {
    let count = inputs.problem.simulator().effects().len();
    (0..count).into_par_iter().map(|effect| limit(inputs, probes, effect)).collect()
}

/// Finds the detection limit of an effect by bisection of the logarithm of its strength, with the
/// same draws at every strength. `None` if the effect would not be named within its range.
fn limit(inputs: LimitInputs<'_>, probes: &Probes, effect: usize) -> Result<Option<f64>, GapError> {
    let Some(own) = probes.first(effect) else { return Ok(None) };
    if (inputs.problem.stop())() {
        return Err(GapError::Stopped);
    }
    let record = Record::of(inputs, probes, own);
    let probe = &probes.all[own];
    // Stop short of the end of the range: the posterior takes an effect there for a compensation of
    // something else.
    let end = INSIDE * probe.reach;
    let (mut low, mut high) = (0.0, probe.distance.abs().min(end));
    while !record.names(probe.amplitude(high)) {
        if high >= end {
            return Ok(None);
        }
        (low, high) = (high, (STEP * high).min(end));
    }
    while low == 0.0 && high > LEAST * end {
        let below = high / STEP;
        if record.names(probe.amplitude(below)) { high = below } else { low = below }
    }
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        if record.names(probe.amplitude(middle)) { high = middle } else { low = middle }
    }
    Ok(Some(probe.strength(high)))
}
