//! The goals of a blind check.

use serde::Serialize;
use stretch_blind::{Rate, Score};

/// A statistic, its goal, and whether the goal is reached.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Goal {
    /// Name of the statistic.
    pub what: &'static str,
    /// The goal in words.
    pub goal: String,
    /// Value of the statistic.
    pub value: Option<f64>,
    /// Hits and cases, if the statistic is a rate.
    pub rate: Option<Rate>,
    /// Whether the goal is reached; `None` if there are no cases, or so few that a single case
    /// would decide.
    pub met: Option<bool>,
}

impl Goal {
    /// Returns the result in words: `yes`, `no`, or `too few` if a single case would decide.
    pub fn verdict(&self) -> &'static str {
        match (self.met, self.value) {
            (Some(true), _) => "yes",
            (Some(false), _) => "no",
            (None, Some(_)) => "too few",
            (None, None) => "",
        }
    }

    /// Returns the row of the table: statistic, goal, value, count, Wilson interval, and result.
    pub fn cells(&self) -> [String; 6] {
        let interval = self.rate.and_then(|rate| rate.wilson());
        [
            self.what.to_owned(),
            self.goal.clone(),
            self.value.map_or_else(|| "no case".to_owned(), |value| format!("{value:.3}")),
            self.rate.map_or_else(String::new, |rate| format!("{} of {}", rate.hits, rate.cases)),
            interval.map_or_else(String::new, |(low, high)| format!("{low:.3} .. {high:.3}")),
            self.verdict().to_owned(),
        ]
    }
}

/// Whether the number of cases is sufficient for a goal that allows the share `may_miss` of errors:
/// the goal allows at least one error, or more than one occurred.
fn is_telling(cases: usize, missed: usize, may_miss: f64) -> bool {
    // in floating point, 1 - 0.95 is slightly less than 1/20
    may_miss * cases as f64 >= 1.0 - 1e-9 || missed > 1
}

/// Returns the goals of a blind check with the results.
pub fn goals(score: &Score) -> Vec<Goal> {
    let s = &score.singles;
    let goal = |what, sign: &str, bound: f64, value: Option<f64>, rate: Option<Rate>| {
        let is_least = sign == ">=";
        let is_telling = rate.is_none_or(|rate| match is_least {
            true => is_telling(rate.cases, rate.cases - rate.hits, 1.0 - bound),
            false => is_telling(rate.cases, rate.hits, bound),
        });
        let met = value.map(|x| if is_least { x >= bound } else { x <= bound });
        let met = met.filter(|_| is_telling);
        Goal { what, goal: format!("{sign} {bound}"), value, rate, met }
    };
    let least = |what, rate: Rate, bound| goal(what, ">=", bound, rate.share(), Some(rate));
    let most = |what, rate: Rate, bound| goal(what, "<=", bound, rate.share(), Some(rate));
    let below = |what, value, bound| goal(what, "<=", bound, value, None);
    let time_s = |of: fn((f64, f64, f64)) -> f64| score.runtime_s.map(of);
    vec![
        least("exactly the one effect named, a declared tie counted right", s.exact, 0.95),
        least("first name", s.top1, 0.95),
        least("stage", s.stage, 0.97),
        least("95 % set covers", s.set_covers, 0.95),
        below("mean size of the 95 % set", s.set_size, 1.4),
        most("verdict other than none on nulls", score.false_alarms, 0.02),
        below("expected calibration error", score.calibration.ece, 0.04),
        least("out of the catalogue: unknown", score.foreign_caught, 0.9),
        least("struck out, no twin: unknown", score.struck_unknown, 0.85),
        most("false unknowns", s.false_unknown, 0.05),
        least("compounds: both named", score.compounds.all_named, 0.85),
        least("compounds: one of them named", score.compounds.one_named, 0.97),
        below("time a case, median, s", time_s(|t| t.0), 1.0),
        below("time a case, 95th percentile, s", time_s(|t| t.1), 3.0),
        below("time a case, greatest, s", time_s(|t| t.2), 6.0),
    ]
}
