//! The branch of each sample of a trial.

use stretch_core::{Branch, RateSource};

use crate::{Options, SplitBy, series::Series};

/// Dead bands of the two rates, each in its own unit per second.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DeadBands {
    pub signal: f64,
    pub target: f64,
}

/// The branch of each sample; `None` where the estimator had no rate yet.
pub(crate) fn branches(series: &Series, options: &Options, dead: DeadBands) -> Vec<Option<Branch>> {
    match options.split {
        SplitBy::Rate => by_rate(series, options.rate_source, dead),
        SplitBy::Trial => {
            let rises = series.target.last() > series.target.first();
            let branch = if rises { Branch::Inflation } else { Branch::Deflation };
            series.signal_rate.iter().map(|rate| rate.map(|_| branch)).collect()
        }
    }
}

fn by_rate(series: &Series, source: RateSource, dead: DeadBands) -> Vec<Option<Branch>> {
    let decide = |i: usize| match source {
        RateSource::Voltage => series.signal_rate[i].map(|rate| (rate, dead.signal)),
        RateSource::Strain => series.signal_rate[i].map(|_| (series.target_rate[i], dead.target)),
    };
    // before the first movement the branch is that of the movement
    let first = (0..series.target.len())
        .filter_map(decide)
        .find(|(rate, dead)| rate.abs() > *dead)
        .map_or(Branch::Inflation, |(rate, dead)| Branch::Inflation.next(rate, dead));
    let mut branch = first;
    (0..series.target.len())
        .map(|i| {
            decide(i).map(|(rate, dead)| {
                branch = branch.next(rate, dead);
                branch
            })
        })
        .collect()
}
