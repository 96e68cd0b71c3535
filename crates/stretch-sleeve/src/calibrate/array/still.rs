//! How many equal samples in a row indicate a stuck channel.
//!
//! Samples of a working channel repeat by chance if noise is less than a step of the converter. Of
//! `n` samples, each a repetition with probability `q`, the longest run of repetitions is about `ln
//! n / ln(1/q)` (Erdos and Renyi 1970; Schilling, The College Mathematics Journal 21 (1990) 196). A
//! run that occurs once in `m` samples is therefore `ln m / ln n` times as long as the longest of
//! `n`, which varies by about one. Repetitions count while another channel changes, because if all
//! channels repeat, the recorder repeats. A count that also decreases, as that of [`Repeats`] does,
//! is about as rare.

use crate::{Repeats, calibrate::channels::Channels};

/// False alarms an hour, of all channels together.
const ALARMS_AN_HOUR: f64 = 0.25;
/// Fewest equal samples in a row that count as sticking, and the longest time that they may take.
const LEAST: f64 = 4.0;
const MOST_S: f64 = 1.0;

/// The longest runs of equal samples that were seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Still {
    /// For each channel the largest number of equal samples in a row, 1 if none repeats.
    pub(crate) longest: Vec<u32>,
    /// Samples of each channel that were looked at.
    pub(crate) samples: u64,
}

impl Still {
    /// The longest runs of channels.
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

    /// Both recordings together.
    pub(crate) fn and(mut self, other: &Self) -> Self {
        self.longest.iter_mut().zip(&other.longest).for_each(|(own, new)| *own = (*own).max(*new));
        self.samples += other.samples;
        self
    }

    /// Number of equal samples in a row that a channel reaches by chance [`ALARMS_AN_HOUR`] times
    /// an hour; 0 if this takes longer than [`MOST_S`].
    pub(crate) fn limit(&self, channel: usize, sample_rate_hz: f64) -> u16 {
        let repetitions = f64::from(self.longest[channel].max(2) - 1);
        let an_alarm = 3600.0 * sample_rate_hz * self.longest.len() as f64 / ALARMS_AN_HOUR;
        let longer = (an_alarm.ln() / (self.samples.max(100) as f64).ln()).max(1.0);
        // one more than these samples bound: the longest is a whole number below ln n / ln(1/q)
        let limit = (1.0 + ((repetitions + 1.0) * longer).ceil()).max(LEAST);
        if limit <= MOST_S * sample_rate_hz { limit as u16 } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Two hours of repetitions with a probability of 0.07, as on knitted sleeves, learnt from two minutes.
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
