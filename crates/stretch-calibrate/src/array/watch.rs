//! When a channel is taken for lost.
//!
//! The fast part of a channel, `h = x - low-pass of x`, is compared with what the fast parts of the others make of it.
//! What a working channel differs by at most in an hour is a Gumbel quantile of the greatest differences of seconds
//! (Gumbel 1958; Coles 2001, chapter 3).

use nalgebra::DVector;
use stretch_core::Interval;

use crate::{CalibrateError, channels::Channels, positive::cholesky};

use super::linear::{FAST_STATES, Linear, Watched, WatchedChannel};

/// False alarms an hour, of all channels together.
const ALARMS_AN_HOUR: f64 = 0.5;
/// Fewest seconds that a quantile is taken from.
const LEAST_BLOCKS: usize = 20;
/// Standard deviations of the difference that are allowed at least.
const LEAST_SD: f64 = 6.0;
/// Standard deviations that are allowed where there are too few seconds.
const UNSEEN_SD: f64 = 12.0;
/// Share of a channel's range by which it may leave that range on either side.
const MARGIN: f64 = 0.5;
/// Fewest equal samples in a row that count as sticking, and the longest time that they may take.
const LEAST_STILL: u32 = 4;
const MOST_STILL_S: f64 = 0.1;
/// Ridge of the regression on the other channels, as a share of their power.
const RIDGE: f64 = 1e-3;

/// What is watched of each channel of a model; `channels` are what it was fitted to, where there is anything.
pub(crate) fn watched(
    linear: &Linear,
    channels: Option<&Channels>,
) -> Result<Watched, CalibrateError> {
    let count = linear.signals.len();
    let found: Option<Vec<_>> = (0..count).map(|k| one(linear, channels, k)).collect();
    let undetermined = || CalibrateError::Undetermined { model: "array".into() };
    Ok(Watched { channels: found.ok_or_else(undetermined)? })
}

fn one(linear: &Linear, channels: Option<&Channels>, k: usize) -> Option<WatchedChannel> {
    let domain = linear.domains[k][0];
    let margin = MARGIN * (domain.max - domain.min);
    let (follows, sd) = follows(linear, k)?;
    let greatest =
        channels.map_or_else(Vec::new, |channels| greatest_of_seconds(channels, &follows, k));
    let largest_surprise = match greatest.len() >= LEAST_BLOCKS {
        true => hourly(&greatest, linear.signals.len()).max(LEAST_SD * sd),
        false => UNSEEN_SD * sd,
    };
    let most_still = (MOST_STILL_S * linear.sample_rate_hz) as u32;
    let still = linear.still_samples[k].saturating_mul(2).max(LEAST_STILL);
    Some(WatchedChannel {
        possible: Interval { min: domain.min - margin, max: domain.max + margin },
        still_samples: u16::try_from(still).ok().filter(|_| still <= most_still).unwrap_or(0),
        follows,
        // a channel that follows the others exactly must still be able to be quiet
        largest_surprise: largest_surprise.max(1e-6 * (domain.max - domain.min)),
    })
}

/// The weights of the fast states of a channel in its own unit, as terms of the bank: `(term, half of its domain)`.
fn fast_terms(linear: &Linear, channel: usize) -> Vec<(usize, f64)> {
    let half = |d: &Interval| 0.5 * (d.max - d.min);
    let first = linear.terms_of(channel).start;
    (1..=usize::from(FAST_STATES)).map(|s| (first + s, half(&linear.domains[channel][s]))).collect()
}

/// The regression of a channel's fast part on those of the others, and the standard deviation of what it misses.
fn follows(linear: &Linear, k: usize) -> Option<(Vec<f64>, f64)> {
    let count = linear.signals.len();
    let fast: Vec<_> = (0..count).map(|channel| fast_terms(linear, channel)).collect();
    let covariance = |a: usize, b: usize| {
        let sum = |i: usize, j: usize| {
            let mean = |t: usize| linear.gram[(0, t)] / linear.gram[(0, 0)];
            linear.gram[(i, j)] / linear.gram[(0, 0)] - mean(i) * mean(j)
        };
        let pairs = fast[a].iter().flat_map(|x| fast[b].iter().map(move |y| (x, y)));
        pairs.map(|(&(i, u), &(j, v))| u * v * sum(i, j)).sum::<f64>()
    };
    let others: Vec<usize> = (0..count).filter(|&c| c != k).collect();
    let mut follows = vec![0.0; count];
    let own = covariance(k, k);
    if others.is_empty() {
        return Some((follows, own.max(0.0).sqrt()));
    }
    let inner = nalgebra::DMatrix::from_fn(others.len(), others.len(), |i, j| {
        let ridge = if i == j { 1.0 + RIDGE } else { 1.0 };
        covariance(others[i], others[j]) * ridge
    });
    let cross = DVector::from_iterator(others.len(), others.iter().map(|&o| covariance(k, o)));
    let weights = cholesky(&inner)?.solve(&cross);
    others.iter().zip(weights.iter()).for_each(|(&o, &w)| follows[o] = w);
    let missed = own - 2.0 * weights.dot(&cross) + weights.dot(&(inner * &weights));
    Some((follows, missed.max(0.0).sqrt()))
}

/// The greatest difference of each second.
fn greatest_of_seconds(channels: &Channels, follows: &[f64], k: usize) -> Vec<f64> {
    let second = (channels.sample_rate.hz().round() as usize).max(1);
    let fast = |states: &[f64]| states[1..=usize::from(FAST_STATES)].iter().sum::<f64>();
    let mut greatest = Vec::new();
    for stretch in &channels.stretches {
        let surprise = |sample: usize| {
            let told: f64 = stretch.at(sample).zip(follows).map(|(s, g)| g * fast(s)).sum();
            (fast(&stretch.states[k][sample]) - told).abs()
        };
        let samples: Vec<usize> = stretch.warmed_up().collect();
        let whole = samples.chunks(second).filter(|block| block.len() == second);
        greatest.extend(whole.map(|block| block.iter().map(|&s| surprise(s)).fold(0.0, f64::max)));
    }
    greatest
}

/// The difference that the greatest of a second exceeds [`ALARMS_AN_HOUR`] times an hour, shared by `channels`.
fn hourly(greatest: &[f64], channels: usize) -> f64 {
    let n = greatest.len() as f64;
    let mean = greatest.iter().sum::<f64>() / n;
    let variance = greatest.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // moments of Gumbel's distribution: mean = mu + gamma beta, variance = (pi beta)^2/6
    let beta = (6.0 * variance).sqrt() / std::f64::consts::PI;
    let mu = mean - 0.577_215_664_901_532_9 * beta;
    let share = ALARMS_AN_HOUR / 3600.0 / channels as f64;
    mu - beta * (-(-share).ln_1p()).ln()
}
