//! The live form of a calibration of several gauges.

use stretch_core::{
    ARRAY_RELAXATIONS, ARRAY_STATES, ARRAY_TERMS, ArrayCalibration, ArrayGains, Design,
    DesignError, Real, Stage, lag, lag_share,
};
use stretch_filter::LARGEST_SAMPLE;

use crate::MAX_BRIDGED;

/// Samples of the warm-up, in which memories forget where they began: channels are compared from then on.
const WARM_UP: u8 = 10;

/// A receptor of up to `N` gauges that share a recorder.
///
/// For each sample:
/// 1. a channel is lost for good where it is missing for more than [`MAX_BRIDGED`] samples, outside of what is possible
///    for it, the same for `still_samples` samples, or where its fast part differs from what the others make of it by
///    more than `largest_surprise`; of several that do, the one that exceeds its largest most. Once a channel is lost,
///    those that are left are no longer compared. [`ArrayMemory::readmit`] takes a channel back;
/// 2. the states of each channel, each moved into its domain and scaled;
/// 3. the gains for the channels that are left: of all, of all but one, or of the best of those left alone.
///
/// A missing sample is bridged by the channel's last one. Cost: two products and two sums for each term of a channel in
/// use.
///
/// ```
/// use stretch_core::{Runner, Stage};
/// use stretch_receptor::{ArrayReceptor, example_array};
/// let receptor = ArrayReceptor::<f32, 2>::new(&example_array())?;
/// let mut receptor = Runner::new(receptor);
/// let reading = (0..50).map(|_| receptor.step([1.5, 1.5])).last().unwrap()?;
/// assert!((reading.estimate - 45.0).abs() < 1e-3 && reading.lost == 0);
/// // the first gauge is cut off: its input is at the end of the converter
/// let reading = (0..10).map(|n| receptor.step([3.3, 1.5 + 1e-3 * n as f32])).last().unwrap()?;
/// assert!(reading.is_lost(0) && !reading.is_lost(1) && (reading.estimate - 45.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayReceptor<T, const N: usize> {
    channels: usize,
    relaxations: usize,
    fast: usize,
    shares: [T; ARRAY_RELAXATIONS],
    terms: usize,
    /// For every term, the term that is extended (0: the constant), and the state that extends it.
    products: [(u8, u8); ARRAY_TERMS],
    of: [Channel<T, N>; N],
    all: Gains<T, N>,
    without: [Gains<T, N>; N],
    alone: [Alone<T>; N],
    low: T,
    high: T,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Channel<T, const N: usize> {
    centre: [T; ARRAY_STATES],
    per_half: [T; ARRAY_STATES],
    least: T,
    most: T,
    still_samples: u16,
    follows: [T; N],
    per_surprise: T,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Gains<T, const N: usize> {
    constant: T,
    sd: T,
    terms: [[T; ARRAY_TERMS]; N],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Alone<T> {
    constant: T,
    sd: T,
    terms: [T; ARRAY_TERMS],
}

/// What an [`ArrayReceptor`] remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayMemory<T, const N: usize> {
    of: [ChannelMemory<T>; N],
    lost: [Option<Loss>; N],
    /// Samples since the beginning or since a loss, up to the warm-up.
    warmed: u8,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct ChannelMemory<T> {
    /// NaN before the first sample.
    last: T,
    low_passes: [T; ARRAY_RELAXATIONS],
    missing: u8,
    still: u16,
}

/// Why a channel is left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Loss {
    /// Its samples are missing.
    Missing,
    /// Its samples are outside of what is possible: cut off, or at the end of the converter.
    Outside,
    /// Its samples are all the same.
    Still,
    /// It moved otherwise than the other channels: it slipped, or it is loose.
    Surprising,
}

/// An answer of an [`ArrayReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayReading<T> {
    /// The estimated reference, in its unit.
    pub estimate: T,
    /// Standard deviation of the estimate, in the same unit, with the channels that are left.
    pub sd: T,
    /// One bit for each channel that is left out, the first channel's the least.
    pub lost: u16,
    /// Whether a state was outside of its domain and moved to its end.
    pub clamped: bool,
}

impl<T> ArrayReading<T> {
    /// Whether a channel is left out.
    pub fn is_lost(&self, channel: usize) -> bool {
        channel < 16 && self.lost & (1 << channel) != 0
    }
}

/// Why there is no [`ArrayReading`] for a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ArrayWithheld {
    /// No sample of a channel in use has come yet.
    Warming,
    /// Every channel is lost.
    AllLost,
}

impl core::fmt::Display for ArrayWithheld {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Warming => "warming",
            Self::AllLost => "all channels lost",
        })
    }
}

impl core::error::Error for ArrayWithheld {}

impl core::fmt::Display for Loss {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(match self {
            Self::Missing => "missing",
            Self::Outside => "outside",
            Self::Still => "still",
            Self::Surprising => "surprising",
        })
    }
}

impl<T: Real, const N: usize> ArrayReceptor<T, N> {
    /// A receptor for a calibration.
    ///
    /// # Errors
    /// [`DesignError`] where a number leaves the range of `T`.
    pub fn new(calibration: &ArrayCalibration<N>) -> Result<Self, DesignError> {
        let period_s = calibration.sample_rate_hz.period_s();
        let mut products = [(0, 0); ARRAY_TERMS];
        let mut terms = 0;
        calibration.shape().each_product(|parent, state| {
            if let Some(place) = products.get_mut(terms) {
                *place = (parent as u8, state as u8);
                terms += 1;
            }
        });
        let zero = T::zero();
        let mut shares = [zero; ARRAY_RELAXATIONS];
        for (share, &tau) in shares.iter_mut().zip(calibration.relaxations_s.iter()) {
            *share = T::from_f64(lag_share(period_s, tau));
        }
        let nothing = Alone { constant: zero, sd: zero, terms: [zero; ARRAY_TERMS] };
        let mut alone = [nothing; N];
        for (k, (place, gains)) in alone.iter_mut().zip(&calibration.alone).enumerate() {
            let Gains { constant, sd, terms } = Gains::<T, N>::round(gains);
            *place = Alone { constant, sd, terms: terms[k] };
        }
        let all = Gains::round(&calibration.all);
        let mut without = [all; N];
        for (place, gains) in without.iter_mut().zip(&calibration.without) {
            *place = Gains::round(gains);
        }
        let mut of = [Channel::unused(); N];
        for (place, channel) in of.iter_mut().zip(&calibration.channels) {
            *place = Channel::round(channel);
        }
        Ok(Self {
            channels: calibration.channels.len(),
            relaxations: calibration.relaxations_s.len(),
            fast: usize::from(calibration.fast_states),
            shares,
            terms,
            products,
            of,
            all,
            without,
            alone,
            low: T::from_f64(calibration.estimate_domain.min),
            high: T::from_f64(calibration.estimate_domain.max),
        })
    }
}

impl<T: Real, const N: usize> Channel<T, N> {
    fn unused() -> Self {
        let (zero, states) = (T::zero(), [T::zero(); ARRAY_STATES]);
        Self {
            centre: states,
            per_half: states,
            least: zero,
            most: zero,
            still_samples: 0,
            follows: [zero; N],
            per_surprise: zero,
        }
    }

    fn round(channel: &stretch_core::ArrayChannel<N>) -> Self {
        let mut own = Self::unused();
        let ends = channel.state_min.iter().zip(channel.state_max.iter());
        for (i, (&min, &max)) in ends.enumerate().take(ARRAY_STATES) {
            own.centre[i] = T::from_f64(0.5 * (min + max));
            own.per_half[i] = T::from_f64(2.0 / (max - min));
        }
        own.least = T::from_f64(channel.possible.min);
        own.most = T::from_f64(channel.possible.max);
        own.still_samples = channel.still_samples;
        for (place, &gain) in own.follows.iter_mut().zip(channel.follows.iter()) {
            *place = T::from_f64(gain);
        }
        own.per_surprise = T::from_f64(channel.largest_surprise.recip());
        own
    }
}

impl<T: Real, const N: usize> Gains<T, N> {
    fn round(gains: &ArrayGains<N>) -> Self {
        let mut terms = [[T::zero(); ARRAY_TERMS]; N];
        for (own, from) in terms.iter_mut().zip(&gains.terms) {
            for (place, &gain) in own.iter_mut().zip(from.iter()) {
                *place = T::from_f64(gain);
            }
        }
        Self { constant: T::from_f64(gains.constant), sd: T::from_f64(gains.sd), terms }
    }
}

impl<T, const N: usize> ArrayMemory<T, N> {
    /// Why a channel is left out; `None` for a channel in use.
    pub fn loss(&self, channel: usize) -> Option<Loss> {
        self.lost.get(channel).copied().flatten()
    }
}

impl<T: Real, const N: usize> ArrayMemory<T, N> {
    /// Takes a channel back that was left out, as if its next sample were its first.
    pub fn readmit(&mut self, channel: usize) {
        if let (Some(lost), Some(own)) = (self.lost.get_mut(channel), self.of.get_mut(channel)) {
            *lost = None;
            *own = ChannelMemory::new();
            self.warmed = 0;
        }
    }
}

impl<T: Real> ChannelMemory<T> {
    fn new() -> Self {
        Self { last: T::nan(), low_passes: [T::zero(); ARRAY_RELAXATIONS], missing: 0, still: 0 }
    }
}

impl<T: Real, const N: usize> Design for ArrayReceptor<T, N> {
    type Memory = ArrayMemory<T, N>;

    fn memory(&self) -> Self::Memory {
        ArrayMemory { of: [ChannelMemory::new(); N], lost: [None; N], warmed: 0 }
    }
}

impl<T: Real, const N: usize> ArrayReceptor<T, N> {
    /// Takes a channel's sample in; answers why the channel is lost, where it is.
    #[inline(always)]
    fn take(&self, k: usize, own: &mut ChannelMemory<T>, sample: T) -> Option<Loss> {
        let of = &self.of[k];
        // the comparison is false for NaN as well
        let usable = sample.abs() <= T::from_f64(LARGEST_SAMPLE);
        if !usable {
            own.missing = own.missing.saturating_add(1);
            if own.missing > MAX_BRIDGED {
                return Some(Loss::Missing);
            }
        } else {
            own.missing = 0;
            if sample < of.least || sample > of.most {
                return Some(Loss::Outside);
            }
            own.still = if sample == own.last { own.still.saturating_add(1) } else { 1 };
            if of.still_samples > 0 && own.still >= of.still_samples {
                return Some(Loss::Still);
            }
        }
        let x = if usable { sample } else { own.last };
        if own.last.is_nan() {
            own.low_passes = [x; ARRAY_RELAXATIONS];
        }
        own.last = x;
        for i in 0..self.relaxations {
            own.low_passes[i] = lag(own.low_passes[i], x, self.shares[i]);
        }
        None
    }

    /// The channel that differs most from what the others make of it, in multiples of its largest difference, where
    /// one differs by more than that.
    #[inline(always)]
    fn surprising(&self, memory: &ArrayMemory<T, N>) -> Option<usize> {
        let mut fast = [T::zero(); N];
        for k in 0..self.channels.min(N) {
            let own = &memory.of[k];
            fast[k] = own.last - own.low_passes[self.fast - 1];
        }
        let mut most = (T::one(), None);
        for k in 0..self.channels.min(N) {
            let of = &self.of[k];
            let mut told = T::zero();
            for (gain, other) in of.follows.iter().zip(&fast) {
                told = told + *gain * *other;
            }
            let share = (fast[k] - told).abs() * of.per_surprise;
            if share > most.0 {
                most = (share, Some(k));
            }
        }
        most.1
    }

    /// The terms of a channel, and whether a state was outside of its domain.
    #[inline(always)]
    fn made(&self, k: usize, own: &ChannelMemory<T>) -> ([T; ARRAY_TERMS], bool) {
        let of = &self.of[k];
        let mut states = [T::zero(); ARRAY_STATES];
        states[0] = own.last;
        let mut before = own.last;
        for i in 0..self.relaxations {
            states[1 + i] = before - own.low_passes[i];
            before = own.low_passes[i];
        }
        let mut clamped = false;
        for (i, state) in states.iter_mut().enumerate().take(1 + self.relaxations) {
            let scaled = (*state - of.centre[i]) * of.per_half[i];
            *state = scaled.max(-T::one()).min(T::one());
            clamped |= *state != scaled;
        }
        let mut made = [T::one(); ARRAY_TERMS];
        for t in 0..self.terms {
            let (parent, state) = self.products[t];
            let before = if parent == 0 { T::one() } else { made[usize::from(parent) - 1] };
            made[t] = before * states[usize::from(state) % ARRAY_STATES];
        }
        (made, clamped)
    }

    /// The sum over the channels that are left.
    fn estimate(&self, memory: &ArrayMemory<T, N>) -> Option<(T, T, bool)> {
        let count = self.channels.min(N);
        let left = (0..count).filter(|&k| memory.lost[k].is_none()).count();
        if left + 1 < count {
            return self.best_alone(memory);
        }
        let gains = match (0..count).find(|&k| memory.lost[k].is_some()) {
            None => &self.all,
            Some(_) if count == 1 => return None,
            Some(lost) => &self.without[lost],
        };
        let (mut sum, mut clamped) = (gains.constant, false);
        for k in 0..count {
            if memory.lost[k].is_some() {
                continue;
            }
            let (made, outside) = self.made(k, &memory.of[k]);
            clamped |= outside;
            for t in 0..self.terms {
                sum = sum + gains.terms[k][t] * made[t];
            }
        }
        Some((sum, gains.sd, clamped))
    }

    fn best_alone(&self, memory: &ArrayMemory<T, N>) -> Option<(T, T, bool)> {
        let mut best: Option<usize> = None;
        for k in 0..self.channels.min(N) {
            let better = best.is_none_or(|b| self.alone[k].sd < self.alone[b].sd);
            if memory.lost[k].is_none() && better {
                best = Some(k);
            }
        }
        let k = best?;
        let (made, clamped) = self.made(k, &memory.of[k]);
        let mut sum = self.alone[k].constant;
        for t in 0..self.terms {
            sum = sum + self.alone[k].terms[t] * made[t];
        }
        Some((sum, self.alone[k].sd, clamped))
    }
}

impl<T: Real, const N: usize> Stage<[T; N]> for ArrayReceptor<T, N> {
    type Out = Result<ArrayReading<T>, ArrayWithheld>;

    fn step(&self, memory: &mut Self::Memory, samples: [T; N]) -> Self::Out {
        let count = self.channels.min(N);
        let mut waiting = false;
        for k in 0..count {
            if memory.lost[k].is_some() {
                continue;
            }
            if let Some(loss) = self.take(k, &mut memory.of[k], samples[k]) {
                memory.lost[k] = Some(loss);
                memory.warmed = 0;
            }
            waiting |= memory.lost[k].is_none() && memory.of[k].last.is_nan();
        }
        if waiting {
            return Err(ArrayWithheld::Warming);
        }
        let none_lost = (0..count).all(|k| memory.lost[k].is_none());
        if memory.warmed < WARM_UP {
            memory.warmed += 1;
        } else if none_lost
            && count > 1
            && let Some(k) = self.surprising(memory)
        {
            memory.lost[k] = Some(Loss::Surprising);
        }
        let (sum, sd, clamped) = self.estimate(memory).ok_or(ArrayWithheld::AllLost)?;
        let mut lost = 0u16;
        for k in 0..count.min(16) {
            lost |= u16::from(memory.lost[k].is_some()) << k;
        }
        Ok(ArrayReading { estimate: sum.max(self.low).min(self.high), sd, lost, clamped })
    }
}
