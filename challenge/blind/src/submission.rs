//! A submission: the answers of a method to every case of a set, checked before it is scored.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::{error::BlindError, plants::OpenTruth, words::worded};

worded! {
    /// What an answer says in one word.
    Said {
        /// The simulator agrees as it is.
        Nothing "none",
        /// It agrees once its parameters are re-tuned.
        Parameters "parameters",
        /// The most probable effects are missing.
        Effect "effect",
        /// The cause is not among the candidates.
        Unknown "unknown",
    }
}

/// Effects that together are all that is missing, and the probability of that: an empty list for
/// nothing, `unknown` for a cause that is no candidate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Believed {
    /// Names, in any order.
    pub effects: Vec<String>,
    /// Between 0 and 1; those of a case sum to 1.
    pub probability: f64,
}

/// The answer to one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    /// What may be missing.
    pub probabilities: Vec<Believed>,
    /// What is said.
    pub verdict: Said,
    /// Effects that an `effect` names; if they are missing, the most probable ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub named: Option<Vec<String>>,
    /// Names that the data cannot tell from the one named.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tied: Vec<String>,
    /// Stage of the gap; absent where there is none.
    #[serde(default)]
    pub place: Option<String>,
    /// Share of the gap of the test trials that the named effects close.
    #[serde(default)]
    pub closed_share: f64,
    /// Time it took, s.
    pub seconds: f64,
    /// Runs of the simulator that it took.
    pub simulations: u64,
}

/// What a method says of a set.
///
/// The layout is `submission.schema.json` of the challenge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submission {
    /// Version of the layout, 1.
    pub schema: u32,
    /// Name of the method.
    pub method: String,
    /// Who set it up, what was tuned, on which cases.
    #[serde(default)]
    pub setup: String,
    /// SHA-256 of the labels, from `set.toml`.
    pub set: String,
    /// Answers by case.
    pub cases: BTreeMap<String, Answer>,
}

/// Largest deviation from 1 of the sum of a case's probabilities.
const SUM_TOLERANCE: f64 = 1e-6;
/// Name of a cause that is no candidate.
pub(crate) const UNKNOWN: &str = "unknown";

impl Submission {
    /// Checks a submission against the set whose labels have the hash `hash`.
    ///
    /// # Errors
    /// The first wrong field: another schema or set, a case that is missing or not in the set, a
    /// name or place that the set does not have, a number out of its range, probabilities that do
    /// not sum to 1, repeated hypotheses.
    pub fn check(&self, truth: &OpenTruth, hash: &str) -> Result<(), BlindError> {
        ensure(self.schema == 1, "schema", || format!("{} is not 1", self.schema))?;
        ensure(!self.method.trim().is_empty(), "method", || "it has no name".to_owned())?;
        ensure(self.set == hash, "set", || {
            format!("{:?} is of another seed or plant; this set is {hash}", self.set)
        })?;
        for case in truth.cases.keys() {
            let field = format!("cases.{case}");
            ensure(self.cases.contains_key(case), &field, || {
                "it is missing: answer it".to_owned()
            })?;
        }
        for (case, answer) in &self.cases {
            let field = format!("cases.{case}");
            ensure(truth.cases.contains_key(case), &field, || {
                "the set has no such case".to_owned()
            })?;
            answer.check(&field, truth)?;
        }
        Ok(())
    }
}

impl Answer {
    fn check(&self, field: &str, truth: &OpenTruth) -> Result<(), BlindError> {
        let at = |name: &str| format!("{field}.{name}");
        let mut seen: Vec<Vec<&String>> = Vec::new();
        for (i, believed) in self.probabilities.iter().enumerate() {
            let place = format!("{field}.probabilities[{i}]");
            let p = believed.probability;
            ensure((0.0..=1.0).contains(&p), &format!("{place}.probability"), || {
                format!("{p} is not between 0 and 1")
            })?;
            let mut names: Vec<&String> = believed.effects.iter().collect();
            names.sort();
            for name in &names {
                let known =
                    truth.candidates.contains_key(*name) || (*name == UNKNOWN && names.len() == 1);
                ensure(known, &format!("{place}.effects"), || {
                    format!(
                        "{name:?} is no candidate of the set (set.toml lists them; unknown stands alone)"
                    )
                })?;
            }
            let is_new = !seen.contains(&names) && names.windows(2).all(|w| w[0] != w[1]);
            ensure(is_new, &format!("{place}.effects"), || "they are there twice".to_owned())?;
            seen.push(names);
        }
        let lists = [("named", self.named.as_ref()), ("tied", Some(&self.tied))];
        for (list, name) in
            lists.into_iter().flat_map(|(l, n)| n.into_iter().flatten().map(move |n| (l, n)))
        {
            ensure(truth.candidates.contains_key(name), &at(list), || {
                format!("{name:?} is no candidate of the set")
            })?;
        }
        let sum: f64 = self.probabilities.iter().map(|b| b.probability).sum();
        ensure((sum - 1.0).abs() <= SUM_TOLERANCE, &at("probabilities"), || {
            format!("they sum to {sum}, not to 1")
        })?;
        if let Some(name) = &self.place {
            ensure(truth.candidates.values().any(|p| p == name), &at("place"), || {
                format!("{name:?} is no place of the set")
            })?;
        }
        let closed = self.closed_share;
        ensure(closed.is_finite() && closed <= 1.0, &at("closed_share"), || {
            format!("{closed} is not at most 1")
        })?;
        ensure(self.seconds.is_finite() && self.seconds >= 0.0, &at("seconds"), || {
            format!("{} is no time", self.seconds)
        })
    }
}

fn ensure(holds: bool, field: &str, reason: impl FnOnce() -> String) -> Result<(), BlindError> {
    if holds {
        return Ok(());
    }
    Err(BlindError::field(field, reason()))
}
