//! Limits beyond which a channel counts as lost.
//!
//! A channel is compared with its prediction from the others. The prediction is a regression between the fast parts of
//! the channels, `h = x - low-pass of x`. The limit is the largest jump of the difference that a working channel has
//! within an hour. It is a Gumbel quantile of the largest jumps of each second (Gumbel 1958; Coles 2001, chapter 3),
//! and at least [`LEAST_SLIP`]. The minimum is needed because a few dozen seconds do not show how far a channel jumps
//! once an hour, and a smaller slip does little harm.

use nalgebra::DVector;
use stretch_calibrate::CalibrateError;
use stretch_core::{Interval, Label, Values};

use crate::{
    ArrayChannel, JUMP_SAMPLES, Jump, MAX_CHANNELS, Repeats, SleeveError,
    calibrate::{
        channels::Channels,
        linear::{Linear, cholesky},
    },
    samples_a_tick,
};

/// Number of memory states whose sum is the fast part of a channel: its change over 0.05 s.
const FAST_STATES: usize = 1;

/// False alarms per hour for slips, of all channels together.
const ALARMS_AN_HOUR: f64 = 0.5;
/// Smallest number of seconds from which a quantile is computed.
const LEAST_BLOCKS: usize = 20;
/// Smallest limit for a slip, as a share of a channel's range. If the data are too short to compute a limit, this value
/// is the limit.
const LEAST_SLIP: f64 = 0.15;
/// Samples may exceed the range of a channel at either end by this share of the range.
const MARGIN: f64 = 0.5;
/// Ridge penalty of the regression on the other channels, as a share of their power.
const RIDGE: f64 = 1e-3;

/// Returns a channel of a model with its limits. `channels` are the fitted data; `None` if there are no such data.
pub(crate) fn watched(
    linear: &Linear,
    channels: Option<&Channels>,
    k: usize,
) -> Result<ArrayChannel<MAX_CHANNELS>, SleeveError> {
    let domain = linear.domains[k][0];
    let margin = MARGIN * (domain.max - domain.min);
    let undetermined = || CalibrateError::Undetermined { model: "array".into() };
    let follows = follows(linear, k).ok_or_else(undetermined)?;
    let list = |f: fn(&Interval) -> f64| linear.domains[k].iter().map(f).collect::<Vec<_>>();
    let greatest =
        channels.map_or_else(Vec::new, |channels| greatest_of_seconds(channels, &follows, k));
    let usual = match greatest.len() >= LEAST_BLOCKS {
        true => hourly(&greatest, linear.signals.len()),
        false => 0.0,
    };
    Ok(ArrayChannel {
        signal: Label::new(&linear.signals[k])?,
        state_min: Values::new("state_min", &list(|d| d.min))?,
        state_max: Values::new("state_max", &list(|d| d.max))?,
        possible: Interval { min: domain.min - margin, max: domain.max + margin },
        still_samples: linear.still.limit(k, linear.sample_rate_hz),
        follows: Values::new("follows", &follows)?,
        largest_jump: usual.max(LEAST_SLIP * (domain.max - domain.min)),
    })
}

/// Returns the weights with which the fast states of a channel add up in its own unit, as pairs `(term of the bank,
/// half of the state's domain)`.
fn fast_terms(linear: &Linear, channel: usize) -> Vec<(usize, f64)> {
    let half = |d: &Interval| 0.5 * (d.max - d.min);
    let first = linear.terms_of(channel).start;
    (1..=FAST_STATES).map(|s| (first + s, half(&linear.domains[channel][s]))).collect()
}

/// Returns the coefficients of the regression of a channel's fast part on those of the others.
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

/// Returns the largest jump in each second.
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

/// Returns the limit that the largest jump in a second exceeds [`ALARMS_AN_HOUR`] times per hour, over all channels
/// together.
fn hourly(greatest: &[f64], channels: usize) -> f64 {
    let n = greatest.len() as f64;
    let mean = greatest.iter().sum::<f64>() / n;
    let variance = greatest.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // Moments of Gumbel's distribution: mean = mu + gamma beta, variance = (pi beta)^2/6.
    let beta = (6.0 * variance).sqrt() / std::f64::consts::PI;
    let mu = mean - 0.577_215_664_901_532_9 * beta;
    let share = ALARMS_AN_HOUR / 3600.0 / channels as f64;
    mu - beta * (-(-share).ln_1p()).ln()
}

/// False alarms per hour for stuck channels, of all channels together.
const STILL_ALARMS_AN_HOUR: f64 = 0.25;
/// Smallest number of equal samples in a row that counts as stuck, and the longest time that the samples may take.
const LEAST_STILL: f64 = 4.0;
const MOST_STILL_S: f64 = 1.0;

/// The longest observed runs of equal samples. From them follows the number of equal samples that indicates a stuck
/// channel.
///
/// Samples of a working channel repeat by chance if the noise is less than a step of the converter. If each of `n`
/// samples is a repetition with probability `q`, the longest run of repetitions is about `ln n / ln(1/q)` (Erdos and
/// Renyi 1970; Schilling, The College Mathematics Journal 21 (1990) 196), and varies by about one. A run that occurs
/// once in `m` samples is therefore `ln m / ln n` times as long as the longest run in `n` samples. Repetitions count
/// only while another channel changes; if all channels repeat, the recorder repeats its samples. The count of
/// [`Repeats`] can also decrease, but it reaches such a limit about as rarely as a run does.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Still {
    /// For each channel the largest number of equal samples in a row, 1 if none repeats.
    pub(crate) longest: Vec<u32>,
    /// Number of samples of each channel that were examined.
    pub(crate) samples: u64,
}

impl Still {
    /// Finds the longest runs in the channels.
    pub(crate) fn of(channels: &Channels) -> Self {
        let count = channels.stretches.first().map_or(0, |s| s.signals.len());
        let mut longest = vec![1; count];
        let mut samples = 0;
        for stretch in &channels.stretches {
            let mut runs = vec![Repeats::new(); count];
            samples += stretch.len() as u64;
            for i in 0..stretch.len() {
                let signals = &stretch.signals;
                let change = i > 0 && signals.iter().any(|x| x[i] != x[i - 1]);
                for ((longest, run), signal) in longest.iter_mut().zip(&mut runs).zip(signals) {
                    *longest = u32::from(run.step(signal[i], change)).max(*longest);
                }
            }
        }
        Self { longest, samples }
    }

    /// Combines the runs of two recordings.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        self.longest.iter_mut().zip(&other.longest).for_each(|(own, new)| *own = (*own).max(*new));
        self.samples += other.samples;
        self
    }

    /// Returns the number of equal samples in a row that a channel reaches by chance [`STILL_ALARMS_AN_HOUR`] times an
    /// hour; 0 if they take longer than [`MOST_STILL_S`].
    pub(crate) fn limit(&self, channel: usize, sample_rate_hz: f64) -> u16 {
        let repetitions = f64::from(self.longest[channel].max(2) - 1);
        let an_alarm = 3600.0 * sample_rate_hz * self.longest.len() as f64 / STILL_ALARMS_AN_HOUR;
        let longer = (an_alarm.ln() / (self.samples.max(100) as f64).ln()).max(1.0);
        // Add one, because the longest run in the samples is a whole number below ln n / ln(1/q).
        let limit = (1.0 + ((repetitions + 1.0) * longer).ceil()).max(LEAST_STILL);
        if limit <= MOST_STILL_S * sample_rate_hz { limit as u16 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// The limits are learnt from two minutes of repetitions with a probability of 0.07, as in knitted sleeves, and
    /// tested on two hours.
    #[test]
    fn chance_repeats_reach_the_limit_less_than_once_an_hour() {
        let mut random = ChaCha8Rng::seed_from_u64(30);
        let mut counts = |samples: usize| {
            let (mut repeats, mut value) = (Repeats::new(), 0.0);
            let mut all = Vec::new();
            for _ in 0..samples {
                value += if random.random::<f64>() < 0.07 { 0.0 } else { 1.0 };
                all.push(repeats.step(value, true));
            }
            all
        };
        let longest: Vec<u32> =
            (0..5).map(|_| u32::from(*counts(12_000).iter().max().unwrap())).collect();
        let still = Still { longest, samples: 12_000 };
        let limits: Vec<u16> = (0..5).map(|k| still.limit(k, 100.0)).collect();
        assert!(limits.iter().all(|limit| (5..=10).contains(limit)), "{limits:?}");
        let alarms: usize =
            limits.iter().map(|limit| counts(720_000).iter().filter(|c| *c == limit).count()).sum();
        assert!(alarms <= 2, "{alarms} in two hours with {limits:?}");
    }
}
