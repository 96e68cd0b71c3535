//! What came of each case, and the figures of a method, each with an interval by bootstrap.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::{
    error::BlindError,
    plants::{Level, OpenLabel, OpenTruth},
    random::RandomGenerator,
    rate::Calibration,
    score::quantile,
    submission::{Answer, Said, Submission, UNKNOWN},
};

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
