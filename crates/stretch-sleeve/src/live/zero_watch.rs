//! Checks whether the zero of a single gauge is still that of its calibration.

use stretch_core::{Design, Polarity, Real, SampleRate};

use crate::Turns;

use super::is_usable;

const LEVELS: usize = Turns::MEDIAN_OF;

/// Detector of movements in a signal. A movement is a fall and a rise by at least `least_span`. It ends when the signal
/// has fallen from its high end by that span again.
///
/// The signal is the median of the last three samples, so that a spike is not a turn. Samples before the first high end
/// are not a movement, because its beginning is unknown.
///
/// ```
/// use stretch_sleeve::TurnFinder;
/// let finder = TurnFinder::new(0.5);
/// let mut memory = finder.memory();
/// let wave = (0..60).map(|n| (n % 20 - 10) as f64 / 10.0).map(f64::abs);
/// let turns: Vec<_> = wave.filter_map(|x| finder.step(&mut memory, x)).collect();
/// // medians of three cut the tips off
/// assert_eq!(turns, [(0.1, 0.9), (0.1, 0.9)]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnFinder<T> {
    /// Smallest change back that counts as a turn.
    pub least_span: T,
}

/// Memory of a [`TurnFinder`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnMemory<T> {
    before: [T; 2],
    samples: u8,
    rises: bool,
    extreme: T,
    low: Option<T>,
}

impl<T: Real> TurnFinder<T> {
    /// Creates a detector of movements of at least `least_span`.
    pub fn new(least_span: T) -> Self {
        Self { least_span }
    }

    /// Returns the memory before the first sample.
    pub fn memory(&self) -> TurnMemory<T> {
        let zero = T::zero();
        TurnMemory { before: [zero; 2], samples: 0, rises: true, extreme: zero, low: None }
    }

    /// Takes a finite sample. Returns the low and the high end at the end of a movement.
    pub fn step(&self, memory: &mut TurnMemory<T>, sample: T) -> Option<(T, T)> {
        let [first, second] = memory.before;
        memory.before = [second, sample];
        if memory.samples < 2 {
            memory.samples += 1;
            return None;
        }
        let middle = first.min(second).max(first.max(second).min(sample));
        if memory.samples == 2 {
            memory.samples = 3;
            memory.extreme = middle;
        }
        if memory.rises {
            memory.extreme = memory.extreme.max(middle);
            if middle < memory.extreme - self.least_span {
                let high = memory.extreme;
                memory.rises = false;
                memory.extreme = middle;
                return memory.low.map(|low| (low, high));
            }
        } else {
            memory.extreme = memory.extreme.min(middle);
            if middle > memory.extreme + self.least_span {
                memory.low = Some(memory.extreme);
                memory.rises = true;
                memory.extreme = middle;
            }
        }
        None
    }
}

/// Detector of a shift of a single gauge's zero across a pause, by the levels at which its signal turns. On request it
/// also follows a slow drift of the zero.
///
/// A movement's level `y` is the weighted mean of its two turning points ([`Turns`]). At the end of each movement `off`
/// is reported: the median of the last five levels minus the level in the calibration.
///
/// A sensor is not put on again within a running movement. The detector therefore compares levels only across a pause:
/// a time of more than `pause_samples` without the end of a movement, or the start. Missing samples count as time. When
/// five movements have ended after the pause, their median is compared with the median of the last five levels before
/// the pause, or with the level in the calibration if there are none. The zero has shifted if the difference exceeds
/// `limit`. The shift is reported until the median after a later pause is within `limit` of the level in the
/// calibration. A drift within a running movement is not reported as a shift, but it shows in `off`.
///
/// A followed zero `z` is the state of a scalar Kalman filter with its steady gain `k`: `z += k clip(y - level - z)`.
/// Innovations are clipped at two standard deviations of levels, and `z` is clipped at the limit, because the
/// calibration has not seen larger changes.
///
/// This assumes that movements return to the ends that they had before. A movement with other ends looks like a shift.
/// Without movements nothing is reported.
///
/// ```
/// use stretch_core::{Design, Polarity, SampleRate};
/// use stretch_sleeve::{Turns, ZeroWatch};
/// // a gauge that rests at 1.24 V, 0.03 mm a millivolt
/// let turns = Turns {
///     level: 1.24, high_share: 0.0, least_span: 0.2, scatter: 0.01, movements: 40, limit: 0.03, pause_s: 8.0,
///     sessions: 0, follow: 0.025, reference_per_signal: -30.0,
/// };
/// let watch = ZeroWatch::<f32>::new(Polarity::Rising, SampleRate::new(100.0)?, &turns);
/// let mut memory = watch.memory();
/// let mut last = None;
/// for n in 0..2000 {
///     // two seconds a movement; put on again 0.25 V higher
///     let volts = 1.49 + 0.6 * ((n % 200) as f32 / 100.0 - 1.0).abs();
///     last = watch.step(&mut memory, volts).or(last);
/// }
/// let zero = last.expect("five movements have ended");
/// assert!(zero.has_shifted && (zero.off_reference + 7.5).abs() < 0.3);
/// # Ok::<(), stretch_core::DesignError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroWatch<T> {
    /// Detector of movements in the product of `sign` and the signal.
    pub finder: TurnFinder<T>,
    /// -1 if the signal falls when the target rises, otherwise 1.
    pub sign: T,
    /// Weights of the low and the high end in a level.
    pub shares: [T; 2],
    /// The level of the calibration, times `sign`.
    pub level: T,
    /// Largest usual difference of the median of levels across a pause.
    pub limit: T,
    /// Largest number of samples between the ends of two movements without a pause.
    pub pause_samples: u32,
    /// Limit at which an innovation is clipped.
    pub most: T,
    /// Share of an innovation by which the zero moves; 0 if the zero is not followed.
    pub follow: T,
    /// Change of the estimate per change of the signal, times `sign`.
    pub reference: T,
}

/// Memory of a [`ZeroWatch`]: the current movement, the levels since the last pause, and the followed zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroMemory<T> {
    turns: TurnMemory<T>,
    levels: [T; LEVELS],
    /// Number of levels since the last pause, at most five.
    held: u8,
    samples: u32,
    /// End of the last movement, in samples.
    end: u32,
    /// End of the first movement after the last pause, in samples.
    first: u32,
    /// Median of the levels before the last pause.
    base: T,
    followed: T,
    since: Option<u32>,
}

/// Result for the zero at the end of a movement.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Zero<T> {
    /// Deviation of the zero from that of the calibration, in the signal's unit.
    pub off: T,
    /// The resulting deviation of the estimate, in the reference's unit, from the slope of the calibration curve at the
    /// turning points.
    pub off_reference: T,
    /// Value of the followed zero: the part of the deviation that is subtracted from the signal, in the signal's unit;
    /// 0 if the zero is not followed.
    pub followed: T,
    /// Whether the zero has shifted across a pause, so that the calibration no longer describes the signal.
    pub has_shifted: bool,
    /// Number of samples since the end of the first movement after the pause across which the zero has shifted; 0
    /// without a shift.
    pub since_samples: u32,
}

impl<T: Real> Design for ZeroWatch<T> {
    type Memory = ZeroMemory<T>;

    fn memory(&self) -> ZeroMemory<T> {
        ZeroMemory {
            turns: self.finder.memory(),
            levels: [T::zero(); LEVELS],
            held: 0,
            samples: 0,
            end: 0,
            first: 0,
            base: self.level,
            followed: T::zero(),
            since: None,
        }
    }
}

impl<T: Real> ZeroWatch<T> {
    /// Creates the detector for a gauge with these turning points, and the polarity and the sample rate of its
    /// calibration.
    pub fn new(polarity: Polarity, sample_rate: SampleRate, turns: &Turns) -> Self {
        let sign = polarity.sign();
        Self {
            finder: TurnFinder::new(T::from_f64(turns.least_span)),
            sign: T::from_f64(sign),
            shares: [T::from_f64(1.0 - turns.high_share), T::from_f64(turns.high_share)],
            level: T::from_f64(sign * turns.level),
            limit: T::from_f64(turns.limit),
            pause_samples: (turns.pause_s * sample_rate.hz()) as u32,
            most: T::from_f64(Turns::MOST_INNOVATION * turns.scatter),
            follow: T::zero(),
            reference: T::from_f64(sign * turns.reference_per_signal),
        }
    }

    /// Returns the same detector, which also follows a slow drift of the zero with the gain in `turns`.
    #[must_use]
    pub fn following(self, turns: &Turns) -> Self {
        Self { follow: T::from_f64(turns.follow), ..self }
    }

    /// Returns a sample minus the followed zero, as the input for a receptor.
    #[inline]
    pub fn corrected(&self, memory: &ZeroMemory<T>, sample: T) -> T {
        sample - self.sign * memory.followed
    }

    /// Adds a number of missing samples to the sample count.
    pub fn lose(&self, memory: &mut ZeroMemory<T>, samples: u32) {
        memory.samples = memory.samples.wrapping_add(samples);
    }

    /// Takes a sample. Returns a result at the end of each movement, from the fifth after a pause on. A missing sample
    /// changes nothing but the sample count.
    pub fn step(&self, memory: &mut ZeroMemory<T>, sample: T) -> Option<Zero<T>> {
        self.lose(memory, 1);
        if !is_usable(sample) {
            return None;
        }
        let (low, high) = self.finder.step(&mut memory.turns, self.sign * sample)?;
        let level = self.shares[0] * low + self.shares[1] * high;
        if memory.samples.wrapping_sub(memory.end) > self.pause_samples {
            if usize::from(memory.held) == LEVELS {
                memory.base = median(memory.levels);
            }
            memory.held = 0;
        }
        memory.end = memory.samples;
        if memory.held == 0 {
            memory.first = memory.samples;
        }
        memory.levels.rotate_left(1);
        memory.levels[LEVELS - 1] = level;
        let clipped = (level - self.level - memory.followed).max(-self.most).min(self.most);
        let moved = memory.followed + self.follow * clipped;
        memory.followed = moved.max(-self.limit).min(self.limit);
        // The levels are compared once after each pause.
        if usize::from(memory.held) < LEVELS {
            memory.held += 1;
            if usize::from(memory.held) < LEVELS {
                return None;
            }
            self.compare(memory);
        }
        let off = median(memory.levels) - self.level;
        Some(Zero {
            off: self.sign * off,
            off_reference: self.reference * off,
            followed: self.sign * memory.followed,
            has_shifted: memory.since.is_some(),
            since_samples: memory.since.map_or(0, |since| memory.samples.wrapping_sub(since)),
        })
    }

    /// Compares the levels after a pause with those before it.
    fn compare(&self, memory: &mut ZeroMemory<T>) {
        let middle = median(memory.levels);
        let is_beyond = |from: T| (middle - from).abs() > self.limit;
        memory.since = match memory.since {
            None => is_beyond(memory.base).then_some(memory.first),
            since => since.filter(|_| is_beyond(self.level)),
        };
    }
}

/// Returns the median of five levels.
fn median<T: Real>(mut levels: [T; LEVELS]) -> T {
    for i in 1..LEVELS {
        let mut k = i;
        while k > 0 && levels[k] < levels[k - 1] {
            levels.swap(k, k - 1);
            k -= 1;
        }
    }
    levels[LEVELS / 2]
}
