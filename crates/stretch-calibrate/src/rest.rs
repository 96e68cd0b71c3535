//! The resting baseline over a log, and which ones are worth trying.

use stretch_core::{Polarity, Range, RestTracker};

use crate::{prepared::Prepared, series::noise};

/// How fast a baseline gives way to a signal below rest, in seconds.
const CATCH_UP_S: f64 = 0.5;
/// Leaks that are tried, as shares of the signal's range per second.
const LEAKS: [f64; 4] = [0.0, 0.0003, 0.001, 0.003];
/// Noise alone may carry the signal this many standard deviations below the level.
const MARGIN: f64 = 1.0;
/// A trial that begins this low in the range begins at rest.
const LOWEST_QUARTER: f64 = 0.25;
/// Samples at a trial's start that may stand at rest.
const FIRST: usize = 50;
/// What a sample counts beyond the level at most, as the receptor has it.
const MOST_EXCESS: f64 = 0.1;

/// Baselines worth trying. The resting level is that of the first trial that
/// begins in the lowest quarter of the range, less what noise alone may do: what
/// later rests have below it is drift.
pub(crate) fn candidates(prepared: &Prepared) -> Vec<RestTracker> {
    let sign = prepared.polarity.sign();
    let starts: Vec<f64> = prepared
        .series
        .iter()
        .map(|series| {
            let first = &series.signal[..series.signal.len().min(FIRST)];
            let mut signed: Vec<f64> = first.iter().map(|v| sign * v).collect();
            signed.sort_by(f64::total_cmp);
            signed[signed.len() / 2]
        })
        .collect();
    let records: Vec<&[f64]> = prepared.series.iter().map(|s| s.signal.as_slice()).collect();
    let lowest = (prepared.series.iter().flat_map(|s| s.signal.iter()).map(|v| sign * v))
        .fold(f64::INFINITY, f64::min);
    let resting = lowest + LOWEST_QUARTER * prepared.signal_range.span();
    let first = starts.iter().copied().find(|&start| start < resting).unwrap_or(lowest);
    let level = sign * (first - MARGIN * noise(&records));
    let span = prepared.signal_range.span();
    let tracker = |share| RestTracker { level, catch_up_s: CATCH_UP_S, leak: share * span };
    LEAKS.map(tracker).into()
}

/// A log less its baseline, as the receptor steps it.
pub(crate) fn rested(
    signal: &[f64],
    rest: Option<RestTracker>,
    polarity: Polarity,
    range: Range,
    period_s: f64,
) -> Vec<f64> {
    let Some(rest) = rest else { return signal.to_vec() };
    let sign = polarity.sign();
    let pull = (period_s / rest.catch_up_s).min(1.0);
    let average = -(-period_s / RestTracker::AVERAGE_S).exp_m1();
    let most = MOST_EXCESS * range.span();
    let furthest = RestTracker::FURTHEST * range.span();
    let (mut baseline, mut excess) = (0.0f64, 0.0);
    let step = |&v: &f64| {
        let above: f64 = sign * v - baseline - sign * rest.level;
        excess += average * (above.clamp(-most, most) - excess);
        let wanted = if excess < 0.0 { pull * excess } else { rest.leak * period_s };
        let before = baseline;
        baseline = (before + wanted).clamp(-furthest, furthest);
        excess -= baseline - before;
        v - sign * baseline
    };
    signal.iter().map(step).collect()
}
