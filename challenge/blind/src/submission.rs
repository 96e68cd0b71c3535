//! A submission: the answers of a method to every case of a set, checked before it is scored; what came of each case,
//! and the figures of the method, each with an interval by bootstrap.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use crate::{
    effect::worded,
    error::BlindError,
    plants::{Level, OpenLabel, OpenTruth},
    random::RandomGenerator,
    rate::Calibration,
    score::quantile,
};

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

/// Refuses a field for a reason, unless the condition holds.
macro_rules! ensure {
    ($holds:expr, $field:expr, $($reason:tt)+) => {
        if !$holds {
            return Err(BlindError::field($field, format!($($reason)+)));
        }
    };
}

/// Largest deviation from 1 of the sum of a case's probabilities.
const SUM_TOLERANCE: f64 = 1e-6;
/// Name of a cause that is no candidate.
const UNKNOWN: &str = "unknown";

impl Submission {
    /// Checks a submission against the set whose labels have the hash `hash`.
    ///
    /// # Errors
    /// The first wrong field: another schema or set, a case that is missing or not in the set, a
    /// name or place that the set does not have, a number out of its range, probabilities that do
    /// not sum to 1, repeated hypotheses.
    pub fn check(&self, truth: &OpenTruth, hash: &str) -> Result<(), BlindError> {
        ensure!(self.schema == 1, "schema", "{} is not 1", self.schema);
        ensure!(!self.method.trim().is_empty(), "method", "it has no name");
        let set = &self.set;
        ensure!(set == hash, "set", "{set:?} is of another seed or plant; this set is {hash}");
        for case in truth.cases.keys() {
            let is_there = self.cases.contains_key(case);
            ensure!(is_there, &format!("cases.{case}"), "it is missing: answer it");
        }
        for (case, answer) in &self.cases {
            let field = format!("cases.{case}");
            ensure!(truth.cases.contains_key(case), &field, "the set has no such case");
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
            let at = |name: &str| at(&format!("probabilities[{i}].{name}"));
            let p = believed.probability;
            ensure!((0.0..=1.0).contains(&p), &at("probability"), "{p} is not between 0 and 1");
            let mut names: Vec<&String> = believed.effects.iter().collect();
            names.sort();
            for name in &names {
                let is_alone = *name == UNKNOWN && names.len() == 1;
                ensure!(
                    is_alone || truth.candidates.contains_key(*name),
                    &at("effects"),
                    "{name:?} is no candidate of the set (set.toml lists them; unknown stands alone)"
                );
            }
            let is_new = !seen.contains(&names) && names.windows(2).all(|w| w[0] != w[1]);
            ensure!(is_new, &at("effects"), "they are there twice");
            seen.push(names);
        }
        for (list, names) in [("named", self.named.as_deref()), ("tied", Some(&self.tied[..]))] {
            for name in names.unwrap_or_default() {
                let is_known = truth.candidates.contains_key(name);
                ensure!(is_known, &at(list), "{name:?} is no candidate of the set");
            }
        }
        let sum: f64 = self.probabilities.iter().map(|b| b.probability).sum();
        let is_whole = (sum - 1.0).abs() <= SUM_TOLERANCE;
        ensure!(is_whole, &at("probabilities"), "they sum to {sum}, not to 1");
        if let Some(name) = &self.place {
            let is_known = truth.candidates.values().any(|p| p == name);
            ensure!(is_known, &at("place"), "{name:?} is no place of the set");
        }
        let Self { closed_share: closed, seconds, .. } = *self;
        let is_share = closed.is_finite() && closed <= 1.0;
        ensure!(is_share, &at("closed_share"), "{closed} is not at most 1");
        let is_time = seconds.is_finite() && seconds >= 0.0;
        ensure!(is_time, &at("seconds"), "{seconds} is no time");
        Ok(())
    }
}

/// Smallest probability in the logarithmic score: a true cause that was held impossible costs ln
/// 1000.
const LEAST_PROBABILITY: f64 = 1e-3;
/// Probability that a covering set reaches.
const COVERED: f64 = 0.95;
/// Draws of the bootstrap.
const DRAWS: usize = 1000;
/// Seed of the bootstrap.
const SEED: u64 = 31;

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

/// A figure, its 95 % interval under resampling of cases, and the number of cases.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Interval {
    /// The figure; absent where no case counts.
    pub value: Option<f64>,
    /// Its 2.5 % quantile.
    pub low: f64,
    /// Its 97.5 % quantile.
    pub high: f64,
    /// Cases.
    pub count: usize,
}

/// The figures of a method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Each figure with its name, in the order of tables.
    pub rows: Vec<(String, Interval)>,
    /// Greatest probability of an answer against how often it was right.
    pub reliability: Calibration,
}

impl Figures {
    /// Figures of outcomes, of one plant or of several together.
    #[must_use]
    pub fn of(all: &[Outcome]) -> Self {
        let some = |keep: &dyn Fn(&Outcome) -> bool| -> Vec<&Outcome> {
            all.iter().filter(|o| keep(o)).collect()
        };
        let of_level = |level: Level| some(&|o| o.level == level);
        let share = |cases: Vec<&Outcome>, hit: fn(&Outcome) -> bool| {
            drawn(&cases, |o| mean(o.iter().map(|o| f64::from(hit(o)))))
        };
        let all = some(&|_| true);
        let placed = some(&|o| o.is_place_right.is_some());
        let closing = some(&|o| o.closed_of_oracle.is_some());
        let log = |o: &&Outcome| -o.probability_of_truth.max(LEAST_PROBABILITY).ln();
        let rows = [
            ("exact", share(all.clone(), |o| o.is_exact)),
            ("exact or tied", share(all.clone(), |o| o.is_exact_or_tied)),
            ("one strong", share(of_level(Level::Strong), |o| o.is_exact)),
            ("one faint", share(of_level(Level::Faint), |o| o.is_exact)),
            ("two", share(of_level(Level::Two), |o| o.is_exact)),
            ("nulls alarmed", share(of_level(Level::Nothing), |o| !o.is_exact)),
            ("foreign: unknown", share(of_level(Level::Foreign), |o| o.is_exact)),
            ("foreign: named", share(of_level(Level::Foreign), |o| o.verdict == Said::Effect)),
            ("place", share(placed, |o| o.is_place_right == Some(true))),
            ("set covers", share(all.clone(), |o| o.is_covered)),
            ("set size", drawn(&all, |o| mean(o.iter().map(|o| o.set_size as f64)))),
            ("calibration error", drawn(&all, |o| reliability(o).ece.unwrap_or(f64::NAN))),
            ("log score, nats", drawn(&all, |o| mean(o.iter().map(log)))),
            (
                "closed, of oracle",
                drawn(&closing, |o| mean(o.iter().filter_map(|o| o.closed_of_oracle))),
            ),
            (
                "seconds, median",
                drawn(&all, |o| {
                    quantile(&mut o.iter().map(|o| o.seconds).collect(), 0.5).unwrap_or(f64::NAN)
                }),
            ),
            ("simulations", drawn(&all, |o| mean(o.iter().map(|o| o.simulations as f64)))),
        ];
        let rows = rows.map(|(name, figure)| (name.to_owned(), figure)).into();
        Self { rows, reliability: reliability(&all) }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x));
    sum / n
}

fn reliability(cases: &[&Outcome]) -> Calibration {
    Calibration::of(cases.iter().map(|o| (o.confidence, o.is_first_right)))
}

/// A figure of cases and its interval over sets of as many cases drawn from them.
fn drawn(cases: &[&Outcome], figure: impl Fn(&[&Outcome]) -> f64) -> Interval {
    if cases.is_empty() {
        return Interval::default();
    }
    let mut random = RandomGenerator::new(SEED, 0);
    let mut again =
        || -> Vec<_> { cases.iter().map(|_| cases[random.below(cases.len())]).collect() };
    let mut values: Vec<f64> = (0..DRAWS).map(|_| figure(&again())).collect();
    values.sort_by(f64::total_cmp);
    Interval {
        value: Some(figure(cases)),
        low: values[DRAWS / 40],
        high: values[DRAWS - 1 - DRAWS / 40],
        count: cases.len(),
    }
}
