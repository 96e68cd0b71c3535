//! Limits at which a channel counts as lost.
//!
//! A channel is compared with the prediction of the others, by a regression of fast parts, `h = x -
//! low-pass of x`. The largest jump of this difference within an hour, for a working channel, is a
//! Gumbel quantile of the largest jumps of seconds (Gumbel 1958; Coles 2001, chapter 3), and at
//! least [`LEAST_SLIP`]. The minimum is needed because a few dozen seconds do not show how far a
//! channel jumps once an hour, and a smaller slip does little harm.

use nalgebra::DVector;
use stretch_calibrate::CalibrateError;
use stretch_core::Interval;

use crate::{
    ArrayShifts, JUMP_SAMPLES, Jump, MAX_CHANNELS, SleeveError,
    calibrate::{
        channels::Channels,
        linear::{Linear, Watched, WatchedChannel},
        matrices::cholesky,
    },
    samples_a_tick,
};

/// Number of memory states whose sum is the fast part of a channel: its change over 0.05 s.
const FAST_STATES: usize = 1;

/// False alarms an hour, of all channels together.
const ALARMS_AN_HOUR: f64 = 0.5;
/// Fewest seconds for a quantile.
const LEAST_BLOCKS: usize = 20;
/// The smallest slip that is searched, as a share of a channel's range; with too few seconds this
/// is the limit.
const LEAST_SLIP: f64 = 0.15;
/// Share of a channel's range by which it may leave that range on either side.
const MARGIN: f64 = 0.5;
/// Ridge of the regression on the other channels, as a share of their power.
const RIDGE: f64 = 1e-3;

/// Limits for each channel of a model; `channels` are the fitted data, if any, and `shifts` the
/// usual differences between channels, if known.
pub(crate) fn watched(
    linear: &Linear,
    channels: Option<&Channels>,
    shifts: Option<ArrayShifts<MAX_CHANNELS>>,
) -> Result<Watched, SleeveError> {
    let count = linear.signals.len();
    let found: Option<Vec<_>> = (0..count).map(|k| one(linear, channels, k)).collect();
    let undetermined = || CalibrateError::Undetermined { model: "array".into() };
    Ok(Watched { channels: found.ok_or_else(undetermined)?, shifts })
}

fn one(linear: &Linear, channels: Option<&Channels>, k: usize) -> Option<WatchedChannel> {
    let domain = linear.domains[k][0];
    let margin = MARGIN * (domain.max - domain.min);
    let follows = follows(linear, k)?;
    let greatest =
        channels.map_or_else(Vec::new, |channels| greatest_of_seconds(channels, &follows, k));
    let usual = match greatest.len() >= LEAST_BLOCKS {
        true => hourly(&greatest, linear.signals.len()),
        false => 0.0,
    };
    Some(WatchedChannel {
        possible: Interval { min: domain.min - margin, max: domain.max + margin },
        still_samples: linear.still.limit(k, linear.sample_rate_hz),
        follows,
        largest_jump: usual.max(LEAST_SLIP * (domain.max - domain.min)),
    })
}

/// The weights of the fast states of a channel in its own unit, as terms of the bank: `(term, half of its domain)`.
fn fast_terms(linear: &Linear, channel: usize) -> Vec<(usize, f64)> {
    let half = |d: &Interval| 0.5 * (d.max - d.min);
    let first = linear.terms_of(channel).start;
    (1..=FAST_STATES).map(|s| (first + s, half(&linear.domains[channel][s]))).collect()
}

/// The regression of a channel's fast part on those of the others.
fn follows(linear: &Linear, k: usize) -> Option<Vec<f64>> {
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
    if others.is_empty() {
        return Some(follows);
    }
    let inner = nalgebra::DMatrix::from_fn(others.len(), others.len(), |i, j| {
        let ridge = if i == j { 1.0 + RIDGE } else { 1.0 };
        covariance(others[i], others[j]) * ridge
    });
    let cross = DVector::from_iterator(others.len(), others.iter().map(|&o| covariance(k, o)));
    let weights = cholesky(&inner)?.solve(&cross);
    others.iter().zip(weights.iter()).for_each(|(&o, &w)| follows[o] = w);
    Some(follows)
}

/// The greatest jump of each second.
fn greatest_of_seconds(channels: &Channels, follows: &[f64], k: usize) -> Vec<f64> {
    let hz = channels.sample_rate.hz();
    let stride = usize::from(samples_a_tick(hz));
    let ticks = (hz.round() as usize / stride).max(1);
    let mut greatest = Vec::new();
    for stretch in &channels.stretches {
        let mut jump = Jump::new();
        let jumps: Vec<f64> = stretch
            .warmed_up()
            .step_by(stride)
            .map(|sample| {
                let told: f64 =
                    stretch.signals.iter().zip(follows).map(|(x, gain)| gain * x[sample]).sum();
                jump.step(stretch.signals[k][sample] - told).abs()
            })
            .skip(usize::from(JUMP_SAMPLES))
            .collect();
        let whole = jumps.chunks_exact(ticks);
        greatest.extend(whole.map(|block| block.iter().copied().fold(0.0, f64::max)));
    }
    greatest
}

/// The jump that the largest of a second exceeds [`ALARMS_AN_HOUR`] times an hour, shared by
/// `channels`.
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
