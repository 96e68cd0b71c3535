//! What came of each case.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::read::{Answer, Said, Submission, UNKNOWN};
use crate::{
    error::BlindError,
    plants::{Level, OpenLabel, OpenTruth},
};

/// Smallest probability in the logarithmic score: a true cause that was held impossible costs ln
/// 1000.
pub(super) const LEAST_PROBABILITY: f64 = 1e-3;
/// Probability that a covering set reaches.
const COVERED: f64 = 0.95;

/// What came of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Name of the case.
    pub case: String,
    /// How hard it is.
    pub level: Level,
    /// What the answer said in one word.
    pub verdict: Said,
    /// Names that it committed to.
    pub named: Vec<String>,
    /// What was true; `unknown` for a cause that is no candidate.
    pub truth: Vec<String>,
    /// Whether exactly that was named: nothing if nothing was missing, `unknown` if the cause is no
    /// candidate.
    pub is_exact: bool,
    /// Whether it is exact, or a declared tie of two holds the one active effect.
    pub is_exact_or_tied: bool,
    /// Greatest probability given.
    pub confidence: f64,
    /// Whether what had it is the truth.
    pub is_first_right: bool,
    /// Probability of the truth.
    pub probability_of_truth: f64,
    /// Whether the most probable answers that make up 95 % hold the truth.
    pub is_covered: bool,
    /// How many answers these are.
    pub set_size: usize,
    /// Whether the stage is right; absent where there is none.
    pub is_place_right: Option<bool>,
    /// Closed share over that of the oracle; absent where no candidate is at work.
    pub closed_of_oracle: Option<f64>,
    /// Time, s.
    pub seconds: f64,
    /// Runs of the simulator.
    pub simulations: u64,
}

/// The outcomes of a submission, as the leaderboard reads them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenScore {
    /// Version of this file, 1.
    pub schema: u32,
    /// Name of the method.
    pub method: String,
    /// How it was set up.
    pub setup: String,
    /// Plant.
    pub plant: String,
    /// Seed, open from now on.
    pub seed: u64,
    /// SHA-256 of the labels.
    pub set: String,
    /// Outcome of each case.
    pub outcomes: Vec<Outcome>,
}

impl OpenScore {
    /// Scores a submission, checked.
    ///
    /// # Errors
    /// As [`Submission::check`].
    pub fn of(submission: &Submission, truth: &OpenTruth, hash: &str) -> Result<Self, BlindError> {
        submission.check(truth, hash)?;
        let outcomes = truth.cases.iter();
        let outcomes = outcomes
            .filter_map(|(case, label)| Some(Outcome::of(case, label, submission.cases.get(case)?)))
            .collect();
        Ok(Self {
            schema: 1,
            method: submission.method.clone(),
            setup: submission.setup.clone(),
            plant: truth.plant.clone(),
            seed: truth.seed,
            set: hash.to_owned(),
            outcomes,
        })
    }
}

fn sorted(names: &[String]) -> Vec<String> {
    let mut names = names.to_vec();
    names.sort();
    names
}

impl Outcome {
    fn of(case: &str, label: &OpenLabel, answer: &Answer) -> Self {
        let truth = match label.level {
            Level::Foreign => vec![UNKNOWN.to_owned()],
            _ => sorted(&label.effects),
        };
        let mut believed: Vec<(Vec<String>, f64)> =
            answer.probabilities.iter().map(|b| (sorted(&b.effects), b.probability)).collect();
        // of equals the one that is listed first
        believed.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (first, confidence) = believed.first().cloned().unwrap_or_default();
        // the most probable effect among the answers
        let effects = |e: &&(Vec<String>, f64)| !e.0.is_empty() && e.0 != [UNKNOWN];
        let named = match answer.verdict {
            Said::Effect if answer.named.is_some() => {
                sorted(answer.named.as_deref().unwrap_or_default())
            }
            Said::Effect => believed.iter().find(effects).map(|e| e.0.clone()).unwrap_or_default(),
            _ => Vec::new(),
        };
        let is_exact = match answer.verdict {
            Said::Nothing | Said::Parameters => label.level == Level::Nothing,
            Said::Unknown => label.level == Level::Foreign,
            Said::Effect => named == truth,
        };
        let is_tied = answer.verdict == Said::Effect
            && named.len() == 1
            && answer.tied.iter().chain(&named).collect::<BTreeSet<_>>().len() == 2
            && truth.len() == 1
            && answer.tied.contains(&truth[0]);
        let mut reached = 0.0;
        let covering = believed.iter().take_while(|(_, p)| {
            let is_needed = reached < COVERED - 1e-9;
            reached += p;
            is_needed
        });
        let covering: Vec<&Vec<String>> = covering.map(|(names, _)| names).collect();
        let place = label.places.first();
        let counts = ![Level::Nothing, Level::Foreign].contains(&label.level);
        let share = answer.closed_share.max(0.0) / label.oracle_closed;
        Self {
            case: case.to_owned(),
            level: label.level,
            verdict: answer.verdict,
            is_exact,
            is_exact_or_tied: is_exact || is_tied,
            confidence,
            is_first_right: first == truth,
            probability_of_truth: believed.iter().find(|b| b.0 == truth).map_or(0.0, |b| b.1),
            is_covered: covering.contains(&&truth),
            set_size: covering.len(),
            is_place_right: place
                .map(|_| answer.place.as_ref().is_some_and(|p| label.places.contains(p))),
            closed_of_oracle: (counts && label.oracle_closed > 0.0).then(|| share.min(1.0)),
            seconds: answer.seconds,
            simulations: answer.simulations,
            named,
            truth,
        }
    }
}
