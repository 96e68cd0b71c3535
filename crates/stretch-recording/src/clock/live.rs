//! Converts the time stamps of a live stream to seconds, one at a time.

use crate::{
    ReadOptions, TimeUnit,
    clock::{Steps, order, spread, unit},
};

/// Number of stamps at the beginning of a stream that are examined to recognise a coarse clock. A clock is coarse if
/// the resolution of its stamps (its tick) is not much shorter than the sample period.
const LOOKED_AT: usize = 64;

/// The clock of a stream.
#[derive(Debug, Clone, Default)]
pub(crate) struct LiveClock {
    /// Counts per second, once known. A count is one unit of a recorded time stamp.
    per_second: Option<f64>,
    /// Whether the unit is assumed to be seconds, because neither an option nor the name nor the value of the time
    /// gives a unit. The length of the first step then determines the unit.
    is_assumed: bool,
    /// Sample rate, if samples are counted instead of reading a time.
    rate_hz: Option<f64>,
    /// Expected sample rate, Hz. It determines the times of samples that share the first stamp, the unit of the first
    /// step, and the even spacing of samples of a coarse clock.
    usual_hz: Option<f64>,
    /// Latest time given to a sample that has the first stamp, in counts.
    first_end: f64,
    /// The newest stamp, as it was recorded.
    last: Option<f64>,
    /// Offset that is added to recorded stamps, from roll-overs and a changed unit.
    added: f64,
    /// The newest positive step, in counts.
    tick: Option<f64>,
    /// Number of samples, and number of positive steps.
    samples: u64,
    ticks: u64,
    /// Samples since the stamp last rose.
    run: u64,
    /// The first stamps, until they show whether the clock is coarse.
    first: Vec<f64>,
    /// Tick of a coarse clock, and time of the newest sample, both in counts.
    coarse: Option<f64>,
    even: f64,
    pub(crate) notes: Vec<String>,
}

/// A time that stays the same or goes back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NotRising {
    pub(crate) time_s: f64,
    pub(crate) previous_s: f64,
}

impl LiveClock {
    /// Creates the clock of a time column, or of samples that are counted at `rate_hz`.
    pub(crate) fn new(column: Option<&str>, rate_hz: Option<f64>, options: &ReadOptions) -> Self {
        let named = || TimeUnit::of(column?);
        let per_second = options.unit_of(column).or_else(named).map(TimeUnit::per_second);
        Self { per_second, rate_hz, usual_hz: options.untimed_hz, ..Self::default() }
    }

    /// Counts a lost row as a sample.
    pub(crate) fn skip(&mut self) {
        self.samples += 1;
    }

    /// Sets the unit to seconds, because the stamps are dates. The name of the column does not matter.
    pub(crate) fn count_seconds(&mut self) {
        self.per_second = Some(1.0);
    }

    /// Returns the time of the next sample in seconds, counted from `origin`. Its stamp is `origin + count`.
    ///
    /// # Errors
    /// Time stays the same or goes back. The clock continues from this stamp.
    pub(crate) fn take(&mut self, row: u64, count: f64, origin: f64) -> Result<f64, NotRising> {
        let sample = self.samples;
        self.samples += 1;
        if let Some(rate_hz) = self.rate_hz {
            return Ok(sample as f64 / rate_hz);
        }
        let mut per_second = self.per_second.unwrap_or_else(|| {
            let epoch = unit::epoch(origin + count);
            self.is_assumed = epoch.is_none();
            epoch.unwrap_or(TimeUnit::Seconds).per_second()
        });
        self.per_second = Some(per_second);
        let Some(last) = self.last.replace(count) else {
            self.first_end = count;
            return Ok(count / per_second);
        };
        let mut step = count - last;
        if step > 0.0
            && std::mem::take(&mut self.is_assumed)
            && let Some(other) = self.usual_hz.and_then(|usual_hz| unit::by_step(step, usual_hz))
        {
            self.notes.push(format!(
                "the time is taken to be in {}, because of its steps",
                other.plural()
            ));
            // Keep the time of the first sample, which was already returned.
            self.added = last * (other.per_second() / per_second - 1.0);
            self.first_end = last + self.added;
            per_second = other.per_second();
            self.per_second = Some(per_second);
        }
        if let Some(tick) = self.tick.filter(|_| step < 0.0)
            && let Some(modulus) = order::roll_over(origin + last, origin + count, tick, per_second)
        {
            (step, self.added) = (step + modulus, self.added + modulus);
            self.notes.push(order::note(row, modulus / per_second, 1));
        }
        let stamp = count + self.added;
        if step > 0.0 {
            (self.tick, self.ticks, self.run) = (Some(step), self.ticks + 1, 0);
            let at = self.evened(row, stamp, per_second).unwrap_or(stamp);
            self.even = at.max(self.after_first(step));
            return Ok(self.even / per_second);
        }
        let period = self.usual_hz.map(|hz| per_second / hz);
        if let Some(tick) = self.tick.or(period).filter(|_| step == 0.0) {
            if self.run == 0 && self.ticks + 1 == sample {
                self.notes.push(format!(
                    "time stamps repeat, first in row {row}; samples with the same time stamp are spread evenly"
                ));
            }
            self.run += 1;
            if self.ticks == 0 {
                self.first_end = stamp + self.run as f64 * tick;
                return Ok(self.first_end / per_second);
            }
            let share = self.run as f64 * self.ticks as f64 / sample as f64;
            // Stay below the next tick, however many samples follow.
            let share = share.min((self.run + 1) as f64 / (self.run + 2) as f64);
            return Ok((stamp + share * tick).max(self.after_first(tick)) / per_second);
        }
        let previous_s = (last + self.added) / per_second;
        *self = Self {
            per_second: self.per_second,
            usual_hz: self.usual_hz,
            first_end: count,
            last: Some(count),
            samples: 1,
            notes: std::mem::take(&mut self.notes),
            ..Self::default()
        };
        Err(NotRising { time_s: count / per_second, previous_s })
    }

    /// Returns the time of a sample on a coarse clock, in counts: one expected period after the previous sample,
    /// limited to the tick of its stamp. Returns `None` if the clock is not known to be coarse.
    fn evened(&mut self, row: u64, stamp: f64, per_second: f64) -> Option<f64> {
        let period = per_second / self.usual_hz?;
        if self.coarse.is_none() && self.first.len() < LOOKED_AT {
            self.first.push(stamp);
            let tick = Steps::of(&self.first).and_then(|steps| spread::tick_of(&self.first, steps));
            self.coarse = tick.filter(|tick| spread::is_even(&self.first, period, *tick));
            if let Some(tick) = self.coarse {
                self.notes.push(format!(
                    "the clock advances in ticks of {} ms; from row {row} on the samples are spread evenly, at {} per second",
                    spread::rounded(1e3 * tick / per_second, 4),
                    spread::rounded(per_second / period, 4)
                ));
            }
        }
        self.coarse.map(|tick| (self.even + period).clamp(stamp, stamp + tick))
    }

    /// Returns the earliest time, in counts, after all samples with the first stamp. If the expected rate is too low,
    /// the times of those samples extend beyond the next stamp.
    fn after_first(&mut self, tick: f64) -> f64 {
        self.first_end += 1e-6 * tick;
        self.first_end
    }
}
