//! The resting baseline over a log, and the candidates for its parameters.

use stretch_core::{Design, Polarity, Range, RestLevel, RestTracker, SampleRate};

use crate::prepare::{Prepared, noise};

/// Time in which the live baseline of a forward model follows a signal below rest, s. The time is short because the
/// level of a forward model is exact.
pub(crate) const LIVE_CATCH_UP_S: f64 = 0.02;
/// Time in which a baseline follows a signal below rest, s.
const CATCH_UP_S: f64 = 0.5;
/// Leaks that are tried, as shares of the signal's range per second.
const LEAKS: [f64; 4] = [0.0, 0.0003, 0.001, 0.003];
/// Standard deviations of the noise by which a signal at rest may lie below the level.
const MARGIN: f64 = 1.0;
/// A trial that begins this low in the range begins at rest.
const LOWEST_QUARTER: f64 = 0.25;
/// Samples at a trial's start that may stand at rest.
const FIRST: usize = 50;

/// Candidate baselines. The resting level is that of the first trial that begins in the lowest quarter of the range,
/// less a margin for noise. Later rests below this level are drift.
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
    let records = prepared.series.iter().map(|s| s.signal.as_slice());
    let lowest = (prepared.series.iter().flat_map(|s| s.signal.iter()).map(|v| sign * v))
        .fold(f64::INFINITY, f64::min);
    let resting = lowest + LOWEST_QUARTER * prepared.signal_range.span();
    let first = starts.iter().copied().find(|&start| start < resting).unwrap_or(lowest);
    let level = sign * (first - MARGIN * noise(records));
    let span = prepared.signal_range.span();
    let tracker = |share| RestTracker { level, catch_up_s: CATCH_UP_S, leak: share * span };
    LEAKS.map(tracker).into()
}

/// A log minus its baseline, computed as in the receptor.
pub(crate) fn rested(
    signal: &[f64],
    rest: Option<RestTracker>,
    polarity: Polarity,
    range: Range,
    sample_rate: SampleRate,
) -> Vec<f64> {
    let level = RestLevel::new(rest, polarity, range, sample_rate);
    let (sign, mut baseline) = (polarity.sign(), level.memory());
    signal.iter().map(|v| sign * level.step(&mut baseline, sign * v, 0.0)).collect()
}
