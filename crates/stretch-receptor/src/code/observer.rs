//! The observer (a gauge model that a Kalman filter inverts) over converter codes, in integers.

use stretch_core::{
    Branch, Calibration, Design, MAX_OBSERVER_PLAYS, MAX_OBSERVER_RELAXATIONS, arithmetic::play,
    fixed::saturate,
};

use super::{
    adc::{Adc, AdcCode},
    observer_numbers::{KNOTS, ObserverNumbers, PLACE_BITS, SHARE_BITS, TARGET_BITS, WEIGHT_BITS},
    receptor::CodeReading,
};
use crate::{Domain, Front, ReceptorError, front::Live, gains::SLOPES};

/// Largest rate: the whole target range in one sample.
const FASTEST: i32 = 1 << TARGET_BITS;
/// Marks a memory that has seen no sample. No calibration has a target as low as this value.
const UNBEGUN: i32 = i32::MIN;
/// Largest magnitude of a relaxation.
const FURTHEST: i32 = 8 << TARGET_BITS;
/// Largest magnitude of a drive, the input of the gauge's curve.
const MOST_DRIVE: i32 = 1 << 30;
/// Smallest length of a secant of the curve, as a share of the distance between knots.
const LEAST_RUN: i32 = (1 << PLACE_BITS) / 100;

/// An [`ObserverReceptor`](crate::ObserverReceptor) in 32-bit integers: the same filter with the same table of gains.
/// It takes converter codes and gives thousandths of the reference's unit (micrometres for millimetres).
///
/// [`FixedObserver::new`] converts a calibration once, on a computer. With the feature `serde` the observer serialises
/// to about 400 bytes. No step can overflow: numbers whose sums could overflow are refused, and states are clamped to
/// their ranges. A code that the converter does not have is a missing sample; up to [`MAX_BRIDGED`](crate::MAX_BRIDGED)
/// missing samples in a row are bridged by prediction.
///
/// ```
/// use stretch_core::Runner;
/// use stretch_receptor::code::{Adc, AdcCode, AdcSpec, FixedObserver};
/// let adc = Adc::new(AdcSpec { bits: 12, zero_v: 0.0, full_scale_v: 3.3 })?;
/// let calibration = stretch_receptor::example_observer();
/// let mut receptor = Runner::new(FixedObserver::new(&calibration, &adc)?);
/// let reading = receptor.step(AdcCode(1861)).expect("an observer needs no warm-up");
/// assert!((150_000..=180_000).contains(&reading.estimate)); // micrometres
/// # Ok::<(), stretch_receptor::ReceptorError>(())
/// ```
pub type FixedObserver = Front<IntegerObserver>;

/// The model of a [`FixedObserver`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegerObserver {
    /// The serialised numbers.
    pub numbers: ObserverNumbers,
    /// Change of the position on the curve per unit of signal in each segment, times `2^recip_bits`.
    pub recips: [i32; KNOTS],
    /// Number of fractional bits of `recips`.
    pub recip_bits: u32,
    /// Index of the gains for each segment's slope.
    pub tangents: [u8; KNOTS],
    /// The signal of a target at rest with settled memory.
    pub at_rest: i32,
}

/// The state of a [`FixedObserver`]'s model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IntegerMemory {
    /// [`UNBEGUN`] before the first sample.
    target: i32,
    /// Rate per sample, not per second.
    rate: i32,
    slow: [i32; MAX_OBSERVER_RELAXATIONS],
    plays: [i32; MAX_OBSERVER_PLAYS],
    baseline: i32,
    excess: i32,
}

impl IntegerMemory {
    #[inline(always)]
    fn begun(&self) -> bool {
        self.target != UNBEGUN
    }
}

impl FixedObserver {
    /// Converts a calibration for the codes of `adc`.
    ///
    /// # Errors
    /// [`ReceptorError`] when the calibration is of another model or a number does
    /// not fit its format.
    pub fn new(calibration: &Calibration, adc: &Adc) -> Result<Self, ReceptorError> {
        Ok(Self { model: ObserverNumbers::new(calibration, adc).map(IntegerObserver::of)? })
    }

    /// Bits of the converter.
    pub fn adc_bits(&self) -> u8 {
        self.model.numbers.adc_bits
    }
}

impl IntegerObserver {
    fn of(n: ObserverNumbers) -> Self {
        let knots = usize::from(n.knots);
        let rise = |k: usize| n.curve[k + 1] - n.curve[k];
        let flattest = (0..knots - 1).map(rise).min().unwrap_or(1).max(1);
        // the flattest segment has the largest reciprocal, which must fit
        let mut recip_bits = 0;
        while recip_bits < 31 && (2i64 << (PLACE_BITS + recip_bits)) / i64::from(flattest) < 1 << 31
        {
            recip_bits += 1;
        }
        let mut out =
            Self { numbers: n, recips: [0; KNOTS], recip_bits, tangents: [0; KNOTS], at_rest: 0 };
        for k in 0..knots - 1 {
            let whole = 1i64 << (PLACE_BITS + recip_bits);
            out.recips[k] = saturate(whole / i64::from(rise(k)));
            let steeper = n.ends.iter().take_while(|&&end| rise(k) >= end).count();
            out.tangents[k] = steeper as u8;
        }
        out.at_rest = out.forward(n.low).0;
        out
    }

    /// Returns the position, in knots, at which the curve has the signal, and the signal clamped to the curve.
    #[inline(always)]
    fn inverse(&self, signal: i32) -> (i32, i32) {
        let last = usize::from(self.numbers.knots) - 1;
        let held = signal.max(self.numbers.curve[0]).min(self.numbers.curve[last]);
        let (mut below, mut above) = (0, last);
        while above - below > 1 {
            let middle = (below + above) / 2;
            if self.numbers.curve[middle % KNOTS] <= held { below = middle } else { above = middle }
        }
        let below = below % KNOTS;
        let part = i64::from(held - self.numbers.curve[below]) * i64::from(self.recips[below]);
        let share = (part >> self.recip_bits) as i32;
        (((below as i32) << PLACE_BITS) + share, held)
    }

    /// Returns the signal at a drive, the index of the drive's segment, and the drive's position clamped to the ends of
    /// the curve.
    #[inline(always)]
    fn forward(&self, drive: i32) -> (i32, usize, i32) {
        let last = i32::from(self.numbers.knots) - 1;
        let from_low = i64::from(drive.saturating_sub(self.numbers.drive_low));
        let place = saturate((from_low * i64::from(self.numbers.per_step)) >> 32);
        let place = place.max(0).min(last << PLACE_BITS);
        let below = ((place >> PLACE_BITS).min(last - 1) as usize) % KNOTS;
        let rise = self.numbers.curve[(below + 1) % KNOTS] - self.numbers.curve[below];
        let share = place - ((below as i32) << PLACE_BITS);
        let risen = (i64::from(rise) * i64::from(share)) >> PLACE_BITS;
        (self.numbers.curve[below] + risen as i32, below, place)
    }

    /// Returns the drive for a target that is at `y` and moves by `rate` per sample.
    #[inline(always)]
    fn drive(&self, memory: &IntegerMemory, y: i32, rate: i32) -> i32 {
        let mut sum = i64::from(self.numbers.lead) * i64::from(rate);
        for i in 0..usize::from(self.numbers.relaxations).min(MAX_OBSERVER_RELAXATIONS) {
            sum += i64::from(self.numbers.amplitudes[i]) * i64::from(y - memory.slow[i]);
        }
        for j in 0..usize::from(self.numbers.plays).min(MAX_OBSERVER_PLAYS) {
            let played = play(memory.plays[j], y, self.numbers.radii[j]);
            sum += i64::from(self.numbers.play_weights[j]) * i64::from(y - played);
        }
        let drive = i64::from(y) + (sum >> WEIGHT_BITS);
        drive.clamp((-MOST_DRIVE).into(), MOST_DRIVE.into()) as i32
    }

    #[inline(always)]
    fn predict(&self, memory: &mut IntegerMemory) {
        memory.target = (memory.target + memory.rate).max(self.numbers.low).min(self.numbers.high);
        for i in 0..usize::from(self.numbers.relaxations).min(MAX_OBSERVER_RELAXATIONS) {
            let step = part(memory.target - memory.slow[i], self.numbers.shares[i]);
            memory.slow[i] += step;
        }
    }

    /// Corrects the states with a signal above its baseline. Returns whether the signal lay on the curve.
    #[inline(always)]
    fn correct(&self, memory: &mut IntegerMemory, signal: i32) -> bool {
        let drive = self.drive(memory, memory.target, memory.rate);
        let (predicted, segment, from) = self.forward(drive);
        let (to, held) = self.inverse(signal);
        let mut place = usize::from(self.tangents[segment]);
        let (run, change) = ((to - from).abs(), (held - predicted).abs());
        if run > LEAST_RUN {
            // finds the limits in `ends` that the slope of the secant, change/run, exceeds; products are compared,
            // which needs no division
            let change = i64::from(change) << PLACE_BITS;
            while place < SLOPES - 1
                && change >= i64::from(self.numbers.ends[place]) * i64::from(run)
            {
                place += 1;
            }
        }
        let last = self.numbers.curve[usize::from(self.numbers.knots - 1) % KNOTS];
        let (first, span) = (self.numbers.curve[0], last - self.numbers.curve[0]);
        let surprise = i64::from(signal.max(first - span).min(last + span) - predicted);
        let gains = &self.numbers.gains[place.min(SLOPES - 1)];
        let half = (1i64 << self.numbers.gain_bits) >> 1;
        let pull =
            |k: usize| saturate((i64::from(gains[k]) * surprise + half) >> self.numbers.gain_bits);
        memory.target = memory.target.saturating_add(pull(0));
        memory.rate = memory.rate.saturating_add(pull(1)).clamp(-FASTEST, FASTEST);
        for i in 0..usize::from(self.numbers.relaxations).min(MAX_OBSERVER_RELAXATIONS) {
            let moved = memory.slow[i].saturating_add(pull(2 + i));
            memory.slow[i] = moved.clamp(-FURTHEST, FURTHEST);
        }
        self.hold(memory);
        held == signal
    }

    #[inline(always)]
    fn hold(&self, memory: &mut IntegerMemory) {
        if memory.target < self.numbers.low {
            memory.target = self.numbers.low;
            memory.rate = memory.rate.max(0);
        }
        if memory.target > self.numbers.high {
            memory.target = self.numbers.high;
            memory.rate = memory.rate.min(0);
        }
        for j in 0..usize::from(self.numbers.plays).min(MAX_OBSERVER_PLAYS) {
            memory.plays[j] = play(memory.plays[j], memory.target, self.numbers.radii[j]);
        }
    }

    /// Updates the baseline, and returns the signal above it.
    #[inline(always)]
    fn above_rest(&self, memory: &mut IntegerMemory, signal: i32) -> i32 {
        let rest = &self.numbers.rest;
        if rest.pull == 0 {
            return signal;
        }
        let shift = if memory.begun() {
            self.forward(self.drive(memory, self.numbers.low, 0)).0 - self.at_rest
        } else {
            0
        };
        let excess = signal.saturating_sub(memory.baseline).saturating_sub(rest.level + shift);
        let held = excess.max(-rest.most).min(rest.most);
        memory.excess += part(held - memory.excess, rest.average);
        let wanted = if memory.excess < 0 { part(memory.excess, rest.pull) } else { rest.leak };
        let before = memory.baseline;
        memory.baseline = (before + wanted).max(-rest.furthest).min(rest.furthest);
        memory.excess -= memory.baseline - before;
        signal - memory.baseline
    }

    fn begin(&self, memory: &mut IntegerMemory, signal: i32) {
        let (place, _) = self.inverse(signal);
        let drive = ((i64::from(place) << 32) / i64::from(self.numbers.per_step))
            + i64::from(self.numbers.drive_low);
        let target = saturate(drive).max(self.numbers.low).min(self.numbers.high);
        memory.target = target;
        memory.rate = 0;
        memory.slow = [target; MAX_OBSERVER_RELAXATIONS];
        memory.plays = [target; MAX_OBSERVER_PLAYS];
    }
}

impl Design for IntegerObserver {
    type Memory = IntegerMemory;

    fn memory(&self) -> IntegerMemory {
        IntegerMemory {
            target: UNBEGUN,
            rate: 0,
            slow: [0; MAX_OBSERVER_RELAXATIONS],
            plays: [0; MAX_OBSERVER_PLAYS],
            baseline: 0,
            excess: 0,
        }
    }
}

impl Live for IntegerObserver {
    type Sample = AdcCode;
    type Signal = i32;
    type Side = Branch;
    type Reading = CodeReading<i32>;

    #[inline(always)]
    fn signal(&self, code: AdcCode) -> Option<i32> {
        // as an unsigned number, a negative code is too large as well
        ((code.0 as u32) < self.numbers.codes()).then(|| self.numbers.signal(code))
    }

    #[inline(always)]
    fn read(
        &self,
        memory: &mut IntegerMemory,
        branch: &mut Branch,
        signal: i32,
    ) -> Option<CodeReading<i32>> {
        let signal = self.above_rest(memory, signal);
        if memory.begun() {
            self.predict(memory);
        } else {
            self.begin(memory, signal);
        }
        let on_curve = self.correct(memory, signal);
        *branch = branch.next(memory.rate, self.numbers.dead_band);
        let scaled = self.numbers.zero + i64::from(self.numbers.gain) * i64::from(memory.target);
        Some(CodeReading {
            estimate: saturate(scaled >> (TARGET_BITS + u32::from(self.numbers.output_bits))),
            branch: *branch,
            domain: Domain::from_flags(!on_curve, false),
        })
    }

    /// Bridges a missing sample with the predicted motion.
    fn bridge(&self, memory: &mut IntegerMemory, _: u8) -> bool {
        let begun = memory.begun();
        if begun {
            self.predict(memory);
            self.hold(memory);
        }
        begun
    }

    fn pause(&self, memory: &mut IntegerMemory) {
        memory.rate = 0;
        self.bridge(memory, 0);
    }
}

/// Multiplies a number by a share and rounds to the nearest integer.
#[inline(always)]
fn part(x: i32, share: i32) -> i32 {
    ((i64::from(x) * i64::from(share) + (1 << (SHARE_BITS - 1))) >> SHARE_BITS) as i32
}

#[cfg(feature = "serde")]
mod record {
    use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

    use super::{FixedObserver, IntegerObserver, ObserverNumbers};

    impl Serialize for FixedObserver {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            self.model.numbers.serialize(serializer)
        }
    }

    impl<'de> Deserialize<'de> for FixedObserver {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let numbers = ObserverNumbers::deserialize(deserializer)?;
            let model = numbers.check().map(IntegerObserver::of).map_err(D::Error::custom)?;
            Ok(Self { model })
        }
    }
}
