//! The figures of a method, each with an interval by bootstrap.

use serde::{Deserialize, Serialize};

use super::outcome::{LEAST_PROBABILITY, Outcome};
use super::read::Said;
use crate::{plants::Level, random::RandomGenerator, score::quantile};

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

/// Draws of the bootstrap.
const DRAWS: usize = 1000;
/// Seed of the bootstrap.
const SEED: u64 = 31;
/// Bins of the reliability.
const BINS: usize = 10;

/// The figures of a method.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Exactly what is missing, over all cases.
    pub exact: Interval,
    /// The same, with a declared tie of two that holds the one effect counted as right.
    pub exact_or_tied: Interval,
    /// Exactly what is missing, over cases of one strong effect.
    pub strong: Interval,
    /// Of one faint effect.
    pub faint: Interval,
    /// Of two.
    pub two: Interval,
    /// Nulls that were given a name or called unknown.
    pub nulls_alarmed: Interval,
    /// Causes that are no candidate, called unknown.
    pub foreign_unknown: Interval,
    /// Causes that are no candidate, given a name.
    pub foreign_named: Interval,
    /// Stage right where there is one.
    pub place: Interval,
    /// The 95 % set holds the truth.
    pub covered: Interval,
    /// Mean number of answers in it.
    pub set_size: Interval,
    /// Expected calibration error of the greatest probability, ten bins.
    pub calibration_error: Interval,
    /// Mean of -ln p of the truth, nats.
    pub log_score: Interval,
    /// Mean closed share over the oracle's.
    pub closed: Interval,
    /// Median time, s.
    pub seconds: Interval,
    /// Mean runs of the simulator.
    pub simulations: Interval,
    /// Of each tenth of confidence: cases, mean confidence, share right.
    pub reliability: Vec<(usize, f64, f64)>,
}

impl Figures {
    /// Figures of outcomes, of one plant or of several together.
    #[must_use]
    pub fn of(all: &[Outcome]) -> Self {
        let all: Vec<&Outcome> = all.iter().collect();
        let some = |keep: fn(&Outcome) -> bool| -> Vec<&Outcome> {
            all.iter().copied().filter(|o| keep(o)).collect()
        };
        let share = |cases: Vec<&Outcome>, hit: fn(&Outcome) -> bool| {
            drawn(&cases, |o| mean(o.iter().map(|o| f64::from(u8::from(hit(o))))))
        };
        let foreign = || some(|o| o.level == Level::Foreign);
        let log = |o: &&Outcome| -o.probability_of_truth.max(LEAST_PROBABILITY).ln();
        Self {
            exact: share(all.clone(), |o| o.is_exact),
            exact_or_tied: share(all.clone(), |o| o.is_exact_or_tied),
            strong: share(some(|o| o.level == Level::Strong), |o| o.is_exact),
            faint: share(some(|o| o.level == Level::Faint), |o| o.is_exact),
            two: share(some(|o| o.level == Level::Two), |o| o.is_exact),
            nulls_alarmed: share(some(|o| o.level == Level::Nothing), |o| !o.is_exact),
            foreign_unknown: share(foreign(), |o| o.is_exact),
            foreign_named: share(foreign(), |o| o.verdict == Said::Effect),
            place: share(some(|o| o.is_place_right.is_some()), |o| o.is_place_right == Some(true)),
            covered: share(all.clone(), |o| o.is_covered),
            set_size: drawn(&all, |o| mean(o.iter().map(|o| o.set_size as f64))),
            calibration_error: drawn(&all, calibration_error),
            log_score: drawn(&all, |o| mean(o.iter().map(log))),
            closed: drawn(&some(|o| o.closed_of_oracle.is_some()), |o| {
                mean(o.iter().filter_map(|o| o.closed_of_oracle))
            }),
            seconds: drawn(&all, |o| {
                quantile(&mut o.iter().map(|o| o.seconds).collect(), 0.5).unwrap_or(f64::NAN)
            }),
            simulations: drawn(&all, |o| mean(o.iter().map(|o| o.simulations as f64))),
            reliability: bins(&all),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x));
    sum / n
}

fn bins(cases: &[&Outcome]) -> Vec<(usize, f64, f64)> {
    let bin = |o: &Outcome| ((o.confidence * BINS as f64) as usize).min(BINS - 1);
    (0..BINS)
        .map(|b| {
            let inside: Vec<_> = cases.iter().filter(|o| bin(o) == b).collect();
            if inside.is_empty() {
                return (0, 0.0, 0.0);
            }
            let right = mean(inside.iter().map(|o| f64::from(u8::from(o.is_first_right))));
            (inside.len(), mean(inside.iter().map(|o| o.confidence)), right)
        })
        .collect()
}

fn calibration_error(cases: &[&Outcome]) -> f64 {
    let error = |(n, p, right): &(usize, f64, f64)| *n as f64 * (p - right).abs();
    bins(cases).iter().map(error).sum::<f64>() / cases.len() as f64
}

/// A figure of cases and its interval over sets of as many cases drawn from them.
fn drawn(cases: &[&Outcome], figure: impl Fn(&[&Outcome]) -> f64) -> Interval {
    if cases.is_empty() {
        return Interval::default();
    }
    let mut random = RandomGenerator::new(SEED, 0);
    let mut values: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let again: Vec<&Outcome> =
                cases.iter().map(|_| cases[random.below(cases.len())]).collect();
            figure(&again)
        })
        .collect();
    values.sort_by(f64::total_cmp);
    Interval {
        value: Some(figure(cases)),
        low: values[DRAWS / 40],
        high: values[DRAWS - 1 - DRAWS / 40],
        count: cases.len(),
    }
}
