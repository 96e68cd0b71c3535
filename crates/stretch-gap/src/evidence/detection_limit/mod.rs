//! Detection limits: how strong each effect would have to be to be named on these data.
//!
//! Let the re-tuned nominal be true, so that what the best set leaves is noise, and let an effect of the strength s be there beside. Around a
//! probe at the strength s_0 its change of the output is
//!
//! ```text
//! d(s) = (s/s_0)^(p/2) d(s_0),     u = d - A (A'V^-1 A + b I)^-1 A'V^-1 d
//! ```
//!
//! in the metric V of every fit, with the sensitivities A of the nominal parameters (b samples a block, prior precision 1), and p = 2 where the
//! change is linear. All that the verdict reads (scores, what is left of the fitted and the test trials, probabilities beside rivals) depends on
//! the noise n through |n|^2 and the few products u_j'V^-1 n, which are normal with the Gram matrix u_i'V^-1 u_j as their covariance: so records
//! are drawn in the space of the effects, never as time series, and the share of them in which the rule of the
//! [posterior](crate::evidence::probability) names the effect is its power (Neyman and Pearson 1933, doi 10.1098/rsta.1933.0009). The detection
//! limit is the strength at which that is 0.9.
//!
//! An effect's other parameters stand at the start from which it is found most easily. Rivals stand at each of their starts; a kink bends the
//! change, so that a limit far from its probe is probed again, and p is that of the two last probes.

mod asked;
mod draws;
mod lags;
mod probes;
mod tuned;

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub(crate) use self::asked::Asked;
use self::{
    draws::Record,
    probes::{Probes, Start, easiest, sizes},
};
use crate::{
    problem::{error::GapError, spec::EffectSpec},
    search::selection::Looked,
};

/// Halvings of the ratio within which a limit is bracketed: to a part in a hundred.
const HALVINGS: usize = 6;
/// Strengths below this share of the range are not asked for.
const LEAST: f64 = 1e-6;
/// Share of the range that a limit lies within, and the ratio of the strengths that are asked for around a probe.
const INSIDE: f64 = 0.99;
const STEP: f64 = 1.5;
/// Ratio of a limit to its probe beyond which it is probed again, and how often at most.
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
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DetectionLimit {
    /// Effect.
    pub effect: String,
    /// Parameter that says how strong it is.
    pub parameter: String,
    /// Value of the parameter at which the effect would be named with probability 0.9 if the re-tuned nominal were otherwise true, its other
    /// parameters at the start from which it is found most easily; none where no value within its range would be.
    pub strength: Option<f64>,
    /// Unit of the value.
    pub unit: String,
    /// Values of the other parameters.
    #[serde(default)]
    pub others: BTreeMap<String, f64>,
}

/// The detection limit of every effect of the catalogue, in its order, but of those whose course is found in the record: they have no strength of their
/// own; `looked` is a screen around the re-tuned nominal, where there is one.
pub(crate) fn detection_limits(
    asked: Asked<'_>,
    looked: Option<&Looked>,
) -> Result<Vec<DetectionLimit>, GapError> {
    let problem = asked.problem;
    let sizes = sizes(problem, looked)?;
    let starts: Vec<Vec<Start>> =
        sizes.into_iter().enumerate().map(|(e, own)| easiest(problem, e, own, asked)).collect();
    let mut probes = Probes::of(problem, asked.best, &starts)?;
    let mut found = limits(asked, &probes)?;
    // What lies far from its probe is probed where it lies; where each run costs, the line has to do.
    let rounds = if problem.simulator().costly().is_none() { ROUNDS } else { 0 };
    for _ in 0..rounds {
        let moved = probes.moved(problem, &found, FAR)?;
        if moved.is_empty() {
            break;
        }
        let again = moved.into_par_iter().map(|e| Ok((e, limit(asked, &probes, e)?)));
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

/// The limit of every effect around its probe.
fn limits(asked: Asked<'_>, probes: &Probes) -> Result<Vec<Option<f64>>, GapError> {
    let count = asked.problem.simulator().effects().len();
    (0..count).into_par_iter().map(|effect| limit(asked, probes, effect)).collect()
}

/// Bisection of the strength, in equal ratios, with the same draws at every strength.
fn limit(asked: Asked<'_>, probes: &Probes, effect: usize) -> Result<Option<f64>, GapError> {
    let Some(own) = probes.first(effect) else { return Ok(None) };
    if (asked.problem.stop())() {
        return Err(GapError::Stopped);
    }
    let record = Record::of(asked, probes, own);
    let probe = &probes.all[own];
    // At the very end of its range an effect rather stands in for something else.
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
