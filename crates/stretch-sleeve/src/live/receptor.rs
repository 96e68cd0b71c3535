//! The receptor of several gauges: a calibration that is applied live, sample by sample.

use stretch_core::{Design, Real, Stage, arithmetic::lag};
use stretch_receptor::{MAX_BRIDGED, numbers::held};

use crate::{ARRAY_RELAXATIONS, ARRAY_STATES, ARRAY_TERMS, ArrayCalibration};

use super::{
    ArrayLoss, ArrayReading, ArrayWithheld,
    channel_watch::{JUMP_SAMPLES, Jump, Repeats},
    is_usable,
    numbers::ArrayNumbers,
};

/// A receptor of up to `N` gauges that share a recorder.
///
/// For each sample:
/// 1. Faulty channels are excluded ("lost"). A channel is lost if
///    - its sample is missing or outside its possible range more than [`MAX_BRIDGED`] times in a row,
///    - it repeats one value ([`Repeats`]) while another channel changes (if all channels repeat their values, the
///      recorder repeats its samples, and no channel is lost), or
///    - it slips: its difference from the value that the other channels predict jumps ([`Jump`]) by more than
///      `largest_jump`. A slip also changes these differences of other channels, so only the channel whose slip explains
///      the largest part of all jumps is excluded. If only two channels move together, it cannot be determined which of
///      them slipped. As soon as a channel is lost, no further slips are searched for.
///
///    A channel that slipped stays lost until [`ArrayMemory::readmit`] is called. Any other lost channel is used again,
///    as if its next sample were its first, after about ten seconds without such a fault
///    ([`ArrayNumbers::samples_to_recover`]).
/// 2. The states of each channel are computed, each shifted and scaled into its domain.
/// 3. The gains for the remaining channels are selected: for all, for all but one, or for the best single channel.
///
/// A sample that is missing or outside the possible range is replaced by the channel's last valid sample. If the
/// samples of all channels in use are missing, the recorder is at fault and no channel counts as lost: up to
/// [`MAX_BRIDGED`] such samples are bridged, and there is no reading for further ones. Cost: two products and two sums
/// for each term of a channel in use.
///
/// ```
/// use stretch_core::{Runner, Stage};
/// use stretch_sleeve::{ArrayReceptor, example_array};
/// let mut receptor = Runner::new(ArrayReceptor::<f32, 2>::new(&example_array()));
/// let reading = (0..50).map(|_| receptor.step([1.5, 1.5])).last().unwrap()?;
/// assert!((reading.estimate - 45.0).abs() < 1e-3 && reading.lost == 0);
/// // the first gauge is cut off: its input is at the end of the converter
/// let reading = (0..10).map(|n| receptor.step([3.3, 1.5 + 1e-3 * n as f32])).last().unwrap()?;
/// assert!(reading.is_lost(0) && !reading.is_lost(1) && (reading.estimate - 45.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayReceptor<T, const N: usize>(ArrayNumbers<T, N>);

/// Memory of an [`ArrayReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArrayMemory<T, const N: usize> {
    of: [ChannelMemory<T>; N],
    lost: [Option<ArrayLoss>; N],
    /// Number of consecutive samples for which no channel in use had a value.
    silent: u8,
    /// Number of ticks (about every 10 ms) in which the channels were compared.
    warmed: u8,
    /// Number of samples since the last tick.
    tick: u16,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct ChannelMemory<T> {
    /// NaN before the first sample.
    last: T,
    low_passes: [T; ARRAY_RELAXATIONS],
    missing: u8,
    /// While the channel is lost: the number of samples in a row without a fault.
    good: u32,
    repeats: Repeats<T>,
    jump: Jump<T>,
}

impl<T: Real, const N: usize> ArrayReceptor<T, N> {
    /// Creates a receptor for a calibration.
    pub fn new(calibration: &ArrayCalibration<N>) -> Self {
        Self(ArrayNumbers::round(calibration))
    }

    /// Returns the numbers that a step uses, for an implementation in another language.
    pub fn numbers(&self) -> &ArrayNumbers<T, N> {
        &self.0
    }
}

impl<T, const N: usize> ArrayMemory<T, N> {
    /// Returns why a channel is excluded; `None` for a channel in use.
    pub fn loss(&self, channel: usize) -> Option<ArrayLoss> {
        self.lost.get(channel).copied().flatten()
    }
}

impl<T: Real, const N: usize> ArrayMemory<T, N> {
    /// Includes an excluded channel again, as if its next sample were its first.
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
        Self {
            last: T::nan(),
            low_passes: [T::zero(); ARRAY_RELAXATIONS],
            missing: 0,
            good: 0,
            repeats: Repeats::new(),
            jump: Jump::new(),
        }
    }
}

impl<T: Real> ChannelMemory<T> {
    /// Updates the low-passes with a sample. If a sample is missing, `x` is the last one again.
    #[inline(always)]
    fn pass(&mut self, x: T, shares: &[T]) {
        if self.last.is_nan() {
            self.low_passes = [x; ARRAY_RELAXATIONS];
        }
        self.last = x;
        for (low_pass, &share) in self.low_passes.iter_mut().zip(shares) {
            *low_pass = lag(*low_pass, x, share);
        }
    }
}

impl<T: Real, const N: usize> Design for ArrayReceptor<T, N> {
    type Memory = ArrayMemory<T, N>;

    fn memory(&self) -> Self::Memory {
        ArrayMemory {
            of: [ChannelMemory::new(); N],
            lost: [None; N],
            silent: 0,
            warmed: 0,
            tick: 0,
        }
    }
}

impl<T: Real, const N: usize> ArrayReceptor<T, N> {
    /// Takes a channel's sample. Returns the reason if the channel is lost.
    #[inline(always)]
    fn take(
        &self,
        k: usize,
        own: &mut ChannelMemory<T>,
        sample: T,
        others_change: bool,
    ) -> Option<ArrayLoss> {
        let of = &self.0.of[k];
        if !is_usable(sample) || sample < of.least || sample > of.most {
            own.missing = own.missing.saturating_add(1);
            if own.missing > MAX_BRIDGED {
                let is_outside = is_usable(sample);
                return Some(if is_outside { ArrayLoss::Outside } else { ArrayLoss::Missing });
            }
            own.pass(own.last, self.shares());
            return None;
        }
        own.missing = 0;
        let repeats = own.repeats.step(sample, others_change);
        if of.still_samples > 0 && repeats >= of.still_samples {
            return Some(ArrayLoss::Still);
        }
        own.pass(sample, self.shares());
        None
    }

    /// Takes a sample of a lost channel. Returns whether enough samples in a row have had no fault.
    fn has_recovered(
        &self,
        k: usize,
        own: &mut ChannelMemory<T>,
        sample: T,
        others_change: bool,
    ) -> bool {
        let of = &self.0.of[k];
        let is_possible = is_usable(sample) && sample >= of.least && sample <= of.most;
        let repeats = if is_possible { own.repeats.step(sample, others_change) } else { 0 };
        if !is_possible || of.still_samples > 0 && repeats >= of.still_samples {
            *own = ChannelMemory::new();
            return false;
        }
        own.good = own.good.saturating_add(1);
        own.good >= self.0.samples_to_recover
    }

    fn shares(&self) -> &[T] {
        &self.0.shares[..self.0.relaxations.min(ARRAY_RELAXATIONS)]
    }

    /// Replaces a sample that is missing in all channels by the last sample of each channel. After too many such
    /// samples there is no reading.
    fn silence(&self, memory: &mut ArrayMemory<T, N>) -> Result<ArrayReading<T>, ArrayWithheld> {
        // Changes of the channels during this time are not jumps.
        memory.warmed = 0;
        memory.silent = memory.silent.saturating_add(1);
        let lost = memory.lost;
        let in_use = || (0..self.0.channels).filter(|&k| lost[k].is_none());
        if in_use().next().is_none() {
            return Err(ArrayWithheld::AllLost);
        }
        if in_use().any(|k| memory.of[k].last.is_nan()) {
            in_use().for_each(|k| memory.of[k] = ChannelMemory::new());
            return Err(ArrayWithheld::Missing);
        }
        for k in in_use() {
            let own = &mut memory.of[k];
            own.pass(own.last, self.shares());
        }
        if memory.silent > MAX_BRIDGED {
            return Err(ArrayWithheld::Missing);
        }
        self.reading(memory)
    }

    /// Returns the reading from the remaining channels.
    fn reading(&self, memory: &ArrayMemory<T, N>) -> Result<ArrayReading<T>, ArrayWithheld> {
        let (sum, sd, clamped) = self.estimate(memory).ok_or(ArrayWithheld::AllLost)?;
        let mut lost = 0u16;
        for k in 0..self.0.channels.min(16) {
            lost |= u16::from(memory.lost[k].is_some()) << k;
        }
        Ok(ArrayReading { estimate: held(sum, self.0.low, self.0.high), sd, lost, clamped })
    }

    /// Returns the channel that slipped, if the difference between a channel and its prediction from the others jumped.
    #[inline(always)]
    fn slipped(&self, memory: &mut ArrayMemory<T, N>) -> Option<usize> {
        let count = self.0.channels;
        let mut jumps = [T::zero(); N];
        let mut exceeds = false;
        for k in 0..count {
            let of = &self.0.of[k];
            let mut told = T::zero();
            for j in 0..count {
                told = told + of.follows[j] * memory.of[j].last;
            }
            let own = &mut memory.of[k];
            jumps[k] = own.jump.step(own.last - told) * of.per_slip;
            exceeds |= jumps[k].abs() > T::one();
        }
        if exceeds && memory.warmed >= JUMP_SAMPLES { self.cause(&jumps) } else { None }
    }

    /// Returns the channel `k` whose slip explains most of all jumps. `r` are the jumps as shares of the largest
    /// allowed jumps. A slip of channel `k` changes them along a vector `m` with `m_k = 1/largest_k` and `m_j =
    /// -follows_jk/largest_j`. It explains `(m'r)^2/m'm` of their squares.
    fn cause(&self, jumps: &[T; N]) -> Option<usize> {
        let count = self.0.channels;
        let mut most = (T::zero(), None);
        for k in 0..count {
            let (mut along, mut power) = (T::zero(), T::zero());
            for j in 0..count {
                let of = &self.0.of[j];
                let moved = if j == k { of.per_slip } else { -(of.follows[k] * of.per_slip) };
                along = along + moved * jumps[j];
                power = power + moved * moved;
            }
            let explained = along * along / power;
            if explained > most.0 {
                most = (explained, Some(k));
            }
        }
        most.1
    }

    /// Compares the channels at every tick of about 10 ms, as long as no channel is lost.
    #[inline(always)]
    fn watch(&self, memory: &mut ArrayMemory<T, N>) {
        let count = self.0.channels;
        if count < 2 || (0..count).any(|k| memory.lost[k].is_some()) {
            return;
        }
        memory.tick += 1;
        if memory.tick < self.0.samples_a_tick {
            return;
        }
        memory.tick = 0;
        memory.warmed = memory.warmed.saturating_add(1);
        if let Some(k) = self.slipped(memory) {
            memory.lost[k] = Some(ArrayLoss::Slipped);
        }
    }

    /// Returns the terms of a channel, and whether a state was outside its domain.
    #[inline(always)]
    fn made(&self, k: usize, own: &ChannelMemory<T>) -> ([T; ARRAY_TERMS], bool) {
        let of = &self.0.of[k];
        let mut states = [T::zero(); ARRAY_STATES];
        states[0] = own.last;
        let mut before = own.last;
        for i in 0..self.0.relaxations {
            states[1 + i] = before - own.low_passes[i];
            before = own.low_passes[i];
        }
        let mut clamped = false;
        for (i, state) in states.iter_mut().enumerate().take(1 + self.0.relaxations) {
            let scaled = (*state - of.centre[i]) * of.per_half[i];
            *state = held(scaled, -T::one(), T::one());
            clamped |= *state != scaled;
        }
        let mut made = [T::one(); ARRAY_TERMS];
        for t in 0..self.0.terms {
            let (parent, state) = self.0.products[t];
            let before = if parent == 0 { T::one() } else { made[usize::from(parent) - 1] };
            made[t] = before * states[usize::from(state) % ARRAY_STATES];
        }
        (made, clamped)
    }

    /// Returns the estimate from the remaining channels, its standard deviation, and whether a state was clamped.
    fn estimate(&self, memory: &ArrayMemory<T, N>) -> Option<(T, T, bool)> {
        let count = self.0.channels;
        let left = (0..count).filter(|&k| memory.lost[k].is_none()).count();
        if left + 1 < count {
            return self.best_alone(memory);
        }
        let gains = match (0..count).find(|&k| memory.lost[k].is_some()) {
            None => &self.0.all,
            Some(_) if count == 1 => return None,
            Some(lost) => &self.0.without[lost],
        };
        let (mut sum, mut clamped) = (gains.constant, false);
        for k in 0..count {
            if memory.lost[k].is_some() {
                continue;
            }
            let (made, outside) = self.made(k, &memory.of[k]);
            clamped |= outside;
            sum = self.plus(sum, &gains.terms[k], &made);
        }
        Some((sum, gains.sd, clamped))
    }

    /// Returns a sum plus the gains times the terms of one more channel.
    #[inline(always)]
    fn plus(&self, mut sum: T, gains: &[T; ARRAY_TERMS], made: &[T; ARRAY_TERMS]) -> T {
        for t in 0..self.0.terms {
            sum = sum + gains[t] * made[t];
        }
        sum
    }

    /// Returns for each channel the estimate from this channel alone minus the estimate from all others, in the
    /// reference's unit and not clipped to the reference's domain. Returns `None` if a channel is lost or has had no
    /// sample, and for a single channel.
    ///
    /// ```
    /// use stretch_core::{Design, Stage};
    /// use stretch_sleeve::{ArrayReceptor, example_array};
    /// let receptor = ArrayReceptor::<f64, 2>::new(&example_array());
    /// let mut memory = receptor.memory();
    /// assert_eq!(receptor.differences(&memory), None);
    /// receptor.step(&mut memory, [1.6, 1.5])?;
    /// // a difference of 0.1 V, at 45 degrees for half a volt
    /// let [first, second] = receptor.differences(&memory).expect("both have a sample");
    /// assert!((first - 9.0).abs() < 1e-9 && (second + 9.0).abs() < 1e-9);
    /// # Ok::<(), stretch_sleeve::ArrayWithheld>(())
    /// ```
    pub fn differences(&self, memory: &ArrayMemory<T, N>) -> Option<[T; N]> {
        let count = self.0.channels;
        let is_watched = |k: usize| memory.lost[k].is_none() && !memory.of[k].last.is_nan();
        if count < 2 || !(0..count).all(is_watched) {
            return None;
        }
        let mut made = [[T::zero(); ARRAY_TERMS]; N];
        for k in 0..count {
            made[k] = self.made(k, &memory.of[k]).0;
        }
        let mut out = [T::zero(); N];
        for k in 0..count {
            let (alone, without) = (&self.0.alone[k], &self.0.without[k]);
            let own = self.plus(alone.constant, &alone.terms[0], &made[k]);
            let mut others = without.constant;
            for j in (0..count).filter(|&j| j != k) {
                others = self.plus(others, &without.terms[j], &made[j]);
            }
            out[k] = own - others;
        }
        Some(out)
    }

    fn best_alone(&self, memory: &ArrayMemory<T, N>) -> Option<(T, T, bool)> {
        let mut best: Option<usize> = None;
        for k in 0..self.0.channels {
            let better = best.is_none_or(|b| self.0.alone[k].sd < self.0.alone[b].sd);
            if memory.lost[k].is_none() && better {
                best = Some(k);
            }
        }
        let k = best?;
        let (made, clamped) = self.made(k, &memory.of[k]);
        let alone = &self.0.alone[k];
        Some((self.plus(alone.constant, &alone.terms[0], &made), alone.sd, clamped))
    }
}

impl<T: Real, const N: usize> Stage<[T; N]> for ArrayReceptor<T, N> {
    type Out = Result<ArrayReading<T>, ArrayWithheld>;

    fn step(&self, memory: &mut Self::Memory, samples: [T; N]) -> Self::Out {
        let count = self.0.channels;
        let (mut waiting, mut change, mut heard) = (false, false, false);
        for k in 0..count {
            let has_sample = memory.lost[k].is_none() && is_usable(samples[k]);
            change |= has_sample && samples[k] != memory.of[k].last;
        }
        for k in 0..count {
            let may_recover = memory.lost[k].is_some_and(|loss| loss != ArrayLoss::Slipped);
            if may_recover && self.has_recovered(k, &mut memory.of[k], samples[k], change) {
                memory.readmit(k);
            }
            heard |= memory.lost[k].is_none() && is_usable(samples[k]);
        }
        if !heard {
            return self.silence(memory);
        }
        memory.silent = 0;
        for k in 0..count {
            if memory.lost[k].is_some() {
                continue;
            }
            if let Some(loss) = self.take(k, &mut memory.of[k], samples[k], change) {
                memory.lost[k] = Some(loss);
            }
            waiting |= memory.lost[k].is_none() && memory.of[k].last.is_nan();
        }
        if waiting {
            return Err(ArrayWithheld::Warming);
        }
        self.watch(memory);
        self.reading(memory)
    }
}
