//! Numbers of a calibration of several gauges, rounded once to the type of the receptor.

use stretch_core::{Real, arithmetic::lag_share};
use stretch_receptor::numbers::rounded;

use crate::{
    ARRAY_RELAXATIONS, ARRAY_STATES, ARRAY_TERMS, ArrayCalibration, ArrayChannel, ArrayGains,
};

use super::samples_a_tick;

/// Ticks without a fault, of about 10 ms each, after which a lost channel is used again.
const RECOVERY_TICKS: u32 = 1000;

/// The numbers of an [`ArrayReceptor`](crate::ArrayReceptor).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayNumbers<T, const N: usize> {
    /// Number of channels.
    pub channels: usize,
    /// Number of time constants of a channel.
    pub relaxations: usize,
    /// Samples between two comparisons of the channels.
    pub samples_a_tick: u16,
    /// Number of consecutive samples without a fault after which a lost channel is used again, unless it slipped: about
    /// ten seconds. This is longer than any limit for equal samples, and longer than a usual movement. Therefore a
    /// channel that saturates in each movement stays lost.
    pub samples_to_recover: u32,
    /// Share of the distance to its input that each low-pass covers in a sample.
    pub shares: [T; ARRAY_RELAXATIONS],
    /// Number of terms of a channel.
    pub terms: usize,
    /// For every term: the term that it extends (0 for the constant), and the state by which that
    /// term is multiplied.
    pub products: [(u8, u8); ARRAY_TERMS],
    /// The channels.
    pub of: [ArrayChannelNumbers<T, N>; N],
    /// Gains for all channels together.
    pub all: ArrayGainNumbers<T, N>,
    /// Gains for all channels but one, for each channel that can be lost.
    pub without: [ArrayGainNumbers<T, N>; N],
    /// Gains for each channel alone.
    pub alone: [ArrayGainNumbers<T, 1>; N],
    /// Smallest estimate.
    pub low: T,
    /// Largest estimate.
    pub high: T,
}

/// The numbers of one channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayChannelNumbers<T, const N: usize> {
    /// Middle of each state's domain.
    pub centre: [T; ARRAY_STATES],
    /// Reciprocal of half of each state's domain.
    pub per_half: [T; ARRAY_STATES],
    /// Smallest possible signal.
    pub least: T,
    /// Largest possible signal.
    pub most: T,
    /// Number of repetitions from which on the channel counts as stuck; 0: repetitions are usual
    /// and not checked.
    pub still_samples: u16,
    /// Coefficients that predict the movement of this channel from the movements of the other channels.
    pub follows: [T; N],
    /// Reciprocal of the largest jump.
    pub per_slip: T,
}

/// Gains of several channels, or of one alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayGainNumbers<T, const N: usize> {
    /// The estimate for terms that are all zero.
    pub constant: T,
    /// Standard deviation of the estimate.
    pub sd: T,
    /// One gain per term, for each channel.
    pub terms: [[T; ARRAY_TERMS]; N],
}

impl<T: Real, const N: usize> ArrayNumbers<T, N> {
    pub(super) fn round(calibration: &ArrayCalibration<N>) -> Self {
        let mut products = [(0, 0); ARRAY_TERMS];
        let mut terms = 0;
        calibration.spec().shape().each_product(|parent, state| {
            if let Some(place) = products.get_mut(terms) {
                *place = (parent as u8, state as u8);
                terms += 1;
            }
        });
        let period_s = calibration.spec().sample_rate_hz.period_s();
        let samples_a_tick = samples_a_tick(calibration.spec().sample_rate_hz.hz());
        let shares = calibration.spec().relaxations_s.iter().map(|&tau| lag_share(period_s, tau));
        let nothing = ArrayGainNumbers {
            constant: T::zero(),
            sd: T::zero(),
            terms: [[T::zero(); ARRAY_TERMS]],
        };
        let mut alone = [nothing; N];
        for (k, (place, gains)) in alone.iter_mut().zip(&calibration.spec().alone).enumerate() {
            let ArrayGainNumbers { constant, sd, terms } = ArrayGainNumbers::<T, N>::round(gains);
            *place = ArrayGainNumbers { constant, sd, terms: [terms[k]] };
        }
        let all = ArrayGainNumbers::round(&calibration.spec().all);
        let mut without = [all; N];
        for (place, gains) in without.iter_mut().zip(&calibration.spec().without) {
            *place = ArrayGainNumbers::round(gains);
        }
        let mut of = [ArrayChannelNumbers::unused(); N];
        for (place, channel) in of.iter_mut().zip(&calibration.spec().channels) {
            *place = ArrayChannelNumbers::round(channel);
        }
        Self {
            channels: calibration.spec().channels.len().min(N),
            relaxations: calibration.spec().relaxations_s.len(),
            samples_a_tick,
            samples_to_recover: RECOVERY_TICKS * u32::from(samples_a_tick),
            shares: rounded(shares),
            terms,
            products,
            of,
            all,
            without,
            alone,
            low: T::from_f64(calibration.spec().estimate_domain.min),
            high: T::from_f64(calibration.spec().estimate_domain.max),
        }
    }
}

impl<T: Real, const N: usize> ArrayChannelNumbers<T, N> {
    fn unused() -> Self {
        let (zero, states) = (T::zero(), [T::zero(); ARRAY_STATES]);
        Self {
            centre: states,
            per_half: states,
            least: zero,
            most: zero,
            still_samples: 0,
            follows: [zero; N],
            per_slip: zero,
        }
    }

    fn round(channel: &ArrayChannel<N>) -> Self {
        let ends = || channel.state_min.iter().zip(channel.state_max.iter());
        Self {
            centre: rounded(ends().map(|(&min, &max)| 0.5 * (min + max))),
            per_half: rounded(ends().map(|(&min, &max)| 2.0 / (max - min))),
            least: T::from_f64(channel.possible.min),
            most: T::from_f64(channel.possible.max),
            still_samples: channel.still_samples,
            follows: rounded(channel.follows.iter().copied()),
            per_slip: T::from_f64(channel.largest_jump.recip()),
        }
    }
}

impl<T: Real, const N: usize> ArrayGainNumbers<T, N> {
    fn round(gains: &ArrayGains<N>) -> Self {
        let mut terms = [[T::zero(); ARRAY_TERMS]; N];
        for (own, from) in terms.iter_mut().zip(&gains.terms) {
            *own = rounded(from.iter().copied());
        }
        Self { constant: T::from_f64(gains.constant), sd: T::from_f64(gains.sd), terms }
    }
}
