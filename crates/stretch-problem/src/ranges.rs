//! Ranges for domain randomisation: from which values a simulator may draw its parameters.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;
use stretch_effects::EffectParameter;
use stretch_gap::{
    Candidate, Description, Diagnosis, Evidence, Known, Model, Place, Spread, covering,
};

use crate::fix::{Chosen, NoFix};

/// Joint distribution of the re-tuned parameters and of the parameters of missing effects.
///
/// Parameters that the data cannot separate are correlated, so they have to be drawn together. To
/// draw a simulator: choose a set with its probability, draw a vector z of independent standard
/// normal numbers, and compute the deviations d = L z with the rows L of `factor`. A parameter
/// is then `value` + d, or `value` exp(d) on a logarithmic scale, limited to `least` and `greatest`.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Ranges {
    /// The smallest collection of sets of effects that holds 95 % of the probability, the most
    /// probable first. If simulator and recording agree, one set without effects.
    pub sets: Vec<RangeSet>,
}

/// A set of effects with the joint distribution of all parameters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RangeSet {
    /// Probability of the set; those of all sets sum to 1.
    pub probability: f64,
    /// Names of the effects.
    pub effects: Vec<String>,
    /// The parameters, in the order of the rows of `factor`.
    pub parameters: Vec<RangeParameter>,
    /// Lower triangular factor L of the covariance C = L L' of the deviations.
    pub factor: Vec<Vec<f64>>,
    /// Values of parameters of the effects that are not drawn, by `effect.parameter`.
    pub fixed: BTreeMap<String, f64>,
}

/// A parameter with its distribution.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RangeParameter {
    /// Name of the parameter, or `effect.parameter`.
    pub name: String,
    /// Unit of the parameter.
    pub unit: String,
    /// Fitted value: the mean, or the median on a logarithmic scale.
    pub value: f64,
    /// Standard deviation, in the unit, or of the logarithm.
    pub sd: f64,
    /// Whether the logarithm of the parameter has the normal distribution.
    pub is_log: bool,
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub greatest: f64,
}

impl Ranges {
    /// Returns the ranges that a diagnosis justifies.
    ///
    /// # Errors
    /// [`NoFix`] if the recording is wrong or the gap is not explained.
    pub(crate) fn of(
        diagnosis: &Diagnosis,
        evidence: &Evidence,
        description: &Description,
    ) -> Result<Self, NoFix> {
        let chosen = Chosen::of(diagnosis, evidence)?;
        if chosen.found.is_none() {
            let (model, spread) = (chosen.model, chosen.spread);
            return Ok(Self { sets: vec![RangeSet::of(&[], 1.0, (model, spread), description)] });
        }
        let fits = evidence.candidates.iter().zip(&evidence.candidate_spreads);
        let probabilities = diagnosis.candidates.iter().map(|c| c.probability);
        let held = covering(&probabilities.collect::<Vec<_>>());
        let kept: Vec<_> = diagnosis.candidates.iter().zip(fits).take(held).collect();
        let total: f64 = kept.iter().map(|(candidate, _)| candidate.probability).sum();
        let one = |(candidate, fit): &(&Candidate, (&Model, &Spread))| {
            let probability = candidate.probability / total;
            RangeSet::of(&candidate.effects, probability, *fit, description)
        };
        Ok(Self { sets: kept.iter().map(one).collect() })
    }

    /// Returns the ranges as JSON that is YAML as well. YAML 1.1 reads a number with an exponent as
    /// text unless it has a decimal point and the exponent has a sign, so both are written.
    pub fn to_text(&self) -> String {
        // This cannot fail, because every key is a string.
        let json = serde_json::to_string_pretty(self).unwrap_or_default();
        let line = |line: &str| {
            let (head, number) = line.split_at(line.rfind(' ').map_or(0, |at| at + 1));
            match number.split_once('e') {
                Some((digits, exponent)) if number.trim_end_matches(',').parse::<f64>().is_ok() => {
                    let point = if digits.contains('.') { "" } else { ".0" };
                    let sign = if exponent.starts_with('-') { "" } else { "+" };
                    format!("{head}{digits}{point}e{sign}{exponent}\n")
                }
                _ => format!("{line}\n"),
            }
        };
        json.lines().map(line).collect()
    }
}

impl RangeSet {
    fn of(
        effects: &[String],
        probability: f64,
        (model, spread): (&Model, &Spread),
        description: &Description,
    ) -> Self {
        let spec = description.spec();
        let factor = spread.factor();
        let parameter = |(known, row): (&Known, &Vec<f64>)| {
            let sd = row.iter().map(|x| x * x).sum::<f64>().sqrt();
            match known.place {
                Place::Nominal(index) => {
                    let p = &spec.parameters[index];
                    let [least, greatest] = p.reach();
                    let (name, unit, value) = (p.name.clone(), p.unit.clone(), known.mean);
                    RangeParameter { name, unit, value, sd, is_log: false, least, greatest }
                }
                Place::Effect { effect, index, is_log } => {
                    let (own, p) = (&spec.effects[effect], &spec.effects[effect].parameters[index]);
                    let value = if is_log { known.mean.exp() } else { known.mean };
                    RangeParameter {
                        name: format!("{}.{}", own.name, p.name),
                        unit: p.unit.to_string(),
                        value,
                        sd,
                        is_log,
                        least: p.min.min(value),
                        greatest: p.max.max(value),
                    }
                }
            }
        };
        let parameters: Vec<_> = spread.parameters.iter().zip(&factor).map(parameter).collect();
        let all = model.effects.iter().flat_map(|(effect, values)| {
            let own = &spec.effects[*effect];
            let name = |p: &EffectParameter| format!("{}.{}", own.name, p.name);
            own.parameters.iter().map(name).zip(values.iter().copied())
        });
        let fixed = all.filter(|(name, _)| parameters.iter().all(|p| p.name != *name)).collect();
        Self { probability, effects: effects.to_vec(), parameters, factor, fixed }
    }
}
