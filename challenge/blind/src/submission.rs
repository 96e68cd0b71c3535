//! A submission holds the answers of a method to all cases of a set. This module checks a submission, scores each
//! case, and computes the statistics of the method with bootstrap intervals.

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
    /// The verdict of an answer.
    Said {
        /// The simulator agrees as it is.
        Nothing "none",
        /// The simulator agrees after its parameters are re-tuned.
        Parameters "parameters",
        /// Effects are missing, and are named.
        Effect "effect",
        /// The cause is not among the candidates.
        Unknown "unknown",
    }
}

/// A hypothesis (the set of all missing effects) and its probability. The set is empty if nothing
/// is missing, and `unknown` if the cause is not among the candidates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Believed {
    /// Names of the effects, in any order.
    pub effects: Vec<String>,
    /// Probability from 0 to 1; the probabilities of a case sum to 1.
    pub probability: f64,
}

/// The answer to one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    /// Hypotheses with their probabilities.
    pub probabilities: Vec<Believed>,
    /// Verdict.
    pub verdict: Said,
    /// Effects that the verdict `effect` names; by default those of the most probable hypothesis
    /// with effects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub named: Option<Vec<String>>,
    /// Effects that the data cannot distinguish from the named one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tied: Vec<String>,
    /// Stage of the gap; absent if there is no gap.
    #[serde(default)]
    pub place: Option<String>,
    /// Share of the gap on the test trials that the named effects close.
    #[serde(default)]
    pub closed_share: f64,
    /// Computing time, s.
    pub seconds: f64,
    /// Number of simulator runs.
    pub simulations: u64,
}

/// The answers of a method to a set.
///
/// The layout is `submission.schema.json` of the challenge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submission {
    /// Version of the layout, 1.
    pub schema: u32,
    /// Name of the method.
    pub method: String,
    /// Who set up the method, what was tuned, and on which cases.
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
/// Name of a cause that is not among the candidates.
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

/// Smallest probability in the logarithmic score. If the true cause had the probability 0, it costs
/// ln 1000.
const LEAST_PROBABILITY: f64 = 1e-3;
/// Probability of the smallest set of hypotheses that counts as covering.
const COVERED: f64 = 0.95;
/// Number of draws of the bootstrap.
const DRAWS: usize = 1000;
/// Seed of the bootstrap.
const SEED: u64 = 31;

/// Result of one case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Name of the case.
    pub case: String,
    /// How hard it is.
    pub level: Level,
    /// Verdict of the answer.
    pub verdict: Said,
    /// Effects that the answer names.
    pub named: Vec<String>,
    /// True effects; `unknown` if the cause is not among the candidates.
    pub truth: Vec<String>,
    /// Whether exactly the true effects were named: none if nothing is missing, `unknown` if the
    /// cause is not among the candidates.
    pub is_exact: bool,
    /// Whether the answer is exact, or declares a tie of two effects that contains the only true
    /// one.
    pub is_exact_or_tied: bool,
    /// Probability of the most probable hypothesis.
    pub confidence: f64,
    /// Whether the most probable hypothesis is true.
    pub is_first_right: bool,
    /// Probability that the answer gives to the true hypothesis.
    pub probability_of_truth: f64,
    /// Whether the true hypothesis is among the most probable ones that together have 95 %
    /// probability.
    pub is_covered: bool,
    /// Number of these hypotheses.
    pub set_size: usize,
    /// Whether the stage is right; absent if there is no true stage.
    pub is_place_right: Option<bool>,
    /// Closed share of the gap divided by that of the oracle (the true effects); absent if no
    /// candidate is active.
    pub closed_of_oracle: Option<f64>,
    /// Computing time in s.
    pub seconds: f64,
    /// Number of runs of the simulator.
    pub simulations: u64,
}

/// The outcomes of a submission, as the leaderboard reads them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenScore {
    /// Version of this file, 1.
    pub schema: u32,
    /// Name of the method.
    pub method: String,
    /// Setup of the method.
    pub setup: String,
    /// Plant.
    pub plant: String,
    /// Seed of the set. It is public from now on.
    pub seed: u64,
    /// SHA-256 of the labels.
    pub set: String,
    /// Outcome of each case.
    pub outcomes: Vec<Outcome>,
}

impl OpenScore {
    /// Checks and scores a submission.
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
        // the sort is stable: of equal probabilities, the hypothesis listed first stays first
        believed.sort_by(|a, b| b.1.total_cmp(&a.1));
        let (first, confidence) = believed.first().cloned().unwrap_or_default();
        // whether a hypothesis names effects of the candidates
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

/// A statistic with its 95 % interval by resampling of the cases, and the number of cases.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Interval {
    /// The statistic; absent if no case counts.
    pub value: Option<f64>,
    /// Lower end of the interval, the 2.5 % quantile.
    pub low: f64,
    /// Upper end of the interval, the 97.5 % quantile.
    pub high: f64,
    /// Number of cases.
    pub count: usize,
}

/// The statistics of a method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Each statistic with its name, in the order of the tables.
    pub rows: Vec<(String, Interval)>,
    /// Calibration of the probability of the most probable hypothesis.
    pub reliability: Calibration,
}

impl Figures {
    /// Computes the statistics of outcomes, of one plant or of several together.
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

/// Computes a statistic of cases, with its interval over resampled sets of the same number of
/// cases.
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
