//! The scored part of a diagnosis of a case.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::effect::Kind;
use crate::error::BlindError;

/// All verdicts of the schema.
const VERDICTS: [&str; 6] = ["no_gap", "parameters", "record", "effect", "partial", "unknown"];
/// Verdicts whose answer is the named effects.
const COMMITS: [&str; 2] = ["effect", "partial"];

/// A diagnosis of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Name of the case: `case-000`.
    pub case: String,
    /// `no_gap`, `parameters`, `record`, `effect`, `partial` or `unknown`.
    pub verdict: String,
    /// Named effects, the most important first.
    pub named: Vec<String>,
    /// Effects in the 95 % set.
    pub ambiguous: Vec<String>,
    /// Effects in a declared tie with the named ones, because the data cannot distinguish them.
    #[serde(default)]
    pub tied: Vec<String>,
    /// Candidates with their probabilities, the best first. A candidate whose only effect is
    /// `unknown` represents causes outside the catalogue.
    pub candidates: Vec<(Vec<String>, f64)>,
    /// Stage to which the gap was assigned.
    pub stage: Option<String>,
    /// Computing time of the diagnosis, s.
    pub runtime_s: f64,
}

/// The scored part of a `diagnosis.json`.
#[derive(Deserialize)]
struct Diagnosis {
    verdict: String,
    named: Vec<String>,
    ambiguous: Vec<String>,
    tied: Option<Vec<String>>,
    candidates: Option<Vec<Candidate>>,
    #[serde(rename = "where")]
    location: Option<Location>,
    runtime_s: Option<f64>,
}

#[derive(Deserialize)]
struct Candidate {
    effects: Vec<String>,
    probability: f64,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Location {
    stages: Vec<StageShare>,
}

#[derive(Deserialize)]
struct StageShare {
    stage: String,
    share: Option<f64>,
}

impl Verdict {
    /// Reads a `diagnosis.json` of a case.
    ///
    /// The stage is that of the first named effect if the catalogue knows it, otherwise the one
    /// with the largest share of the gap.
    ///
    /// # Errors
    /// [`BlindError::Field`] if the verdict, the names, or a probability are missing or out of
    /// range.
    pub fn from_diagnosis(case: &str, diagnosis: &Value) -> Result<Self, BlindError> {
        let bad = |reason: &str| BlindError::field(case, reason);
        let read = Diagnosis::deserialize(diagnosis).map_err(|e| bad(&e.to_string()))?;
        if !VERDICTS.contains(&read.verdict.as_str()) {
            return Err(bad("a verdict that the schema does not have"));
        }
        let commits = COMMITS.contains(&read.verdict.as_str());
        if commits && read.named.is_empty() {
            return Err(bad("an effect without a name"));
        }
        let candidates = read.candidates.unwrap_or_default();
        if candidates.iter().any(|c| !(0.0..=1.0 + 1e-9).contains(&c.probability)) {
            return Err(bad("a probability outside 0..1"));
        }
        let shares = read.location.unwrap_or_default().stages;
        let placed = shares
            .into_iter()
            .max_by(|a, b| a.share.unwrap_or(0.0).total_cmp(&b.share.unwrap_or(0.0)));
        let known = read.named.first().filter(|_| commits).and_then(|name| Kind::named(name));
        Ok(Self {
            case: case.to_owned(),
            verdict: read.verdict,
            ambiguous: read.ambiguous,
            tied: read.tied.unwrap_or_default(),
            stage: known.map(|k| k.spec().stage.name().to_owned()).or(placed.map(|s| s.stage)),
            runtime_s: read.runtime_s.unwrap_or(0.0),
            named: read.named,
            candidates: candidates.into_iter().map(|c| (c.effects, c.probability)).collect(),
        })
    }

    /// Returns the effects of the answer: the named effects if the verdict is `effect` or
    /// `partial`, otherwise none.
    #[must_use]
    pub fn answer(&self) -> &[String] {
        if COMMITS.contains(&self.verdict.as_str()) { &self.named } else { &[] }
    }

    /// Returns the effects in a declared tie with those of the answer.
    pub(crate) fn ties(&self) -> &[String] {
        if self.answer().is_empty() { &[] } else { &self.tied }
    }

    /// Returns the effects of the most probable candidate and those tied with them, and their joint
    /// probability.
    pub(crate) fn belief(&self) -> Option<(Vec<&String>, f64)> {
        // Of equally probable candidates, take the one that is listed first.
        let candidates = self.candidates.iter().rev();
        let (first, probability) = candidates.max_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut names: Vec<&String> = first.iter().take(1).collect();
        let mut sum = *probability;
        if first.len() == 1 && self.answer() == first.as_slice() {
            for name in self.ties().iter().filter(|name| *name != &first[0]) {
                names.push(name);
                let alone = self.candidates.iter().find(|c| c.0.as_slice() == [name.clone()]);
                sum += alone.map_or(0.0, |c| c.1);
            }
        }
        Some((names, sum.min(1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_diagnosis_is_read_and_nonsense_refused() {
        let text = r#"{ "schema": 2, "verdict": "effect", "named": ["leak"],
            "ambiguous": ["leak", "supply_sag"],
            "candidates": [ { "effects": ["leak"], "probability": 0.8, "gap_before": 41.0,
                              "gap_after": 1.4, "closed": 0.96 } ],
            "where": { "stages": [ { "stage": "sensing", "share": 0.9 } ] },
            "runtime_s": 3.1 }"#;
        let mut value: Value = serde_json::from_str(text).expect("JSON");
        let verdict = Verdict::from_diagnosis("case-001", &value).expect("a verdict");
        assert_eq!(verdict.stage.as_deref(), Some("pneumatics"));
        value["verdict"] = "partial".into();
        value["tied"] = serde_json::json!(["supply_sag"]);
        let partial = Verdict::from_diagnosis("case-001", &value).expect("a verdict");
        assert_eq!(
            (partial.answer(), partial.ties()),
            (&["leak".to_owned()][..], &partial.tied[..])
        );
        value["verdict"] = "record".into();
        assert!(Verdict::from_diagnosis("case-001", &value).expect("read").answer().is_empty());
        value["tied"] = "supply_sag".into();
        assert!(Verdict::from_diagnosis("case-001", &value).is_err());
        value["tied"] = Value::Null;
        value["verdict"] = "unknown".into();
        let unknown = Verdict::from_diagnosis("case-001", &value).expect("a verdict");
        assert_eq!(unknown.stage.as_deref(), Some("sensing"));
        assert!(unknown.answer().is_empty());
        value["candidates"][0]["probability"] = 1.4.into();
        assert!(Verdict::from_diagnosis("case-001", &value).is_err());
        assert!(Verdict::from_diagnosis("case-001", &Value::Null).is_err());
    }
}
