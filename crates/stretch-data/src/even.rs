//! Resampling of a trial to a uniform time grid: short gaps are bridged, long gaps split the trial.

use std::{borrow::Cow, ops::Range};

use crate::{DataError, Trial};

/// Largest number of consecutive lost samples that is bridged, the same as in a live receptor. A longer gap splits the
/// trial.
const MOST_BRIDGED: usize = 3;
/// Largest deviation of a sample from its grid point, in periods, at which the sample is taken
/// unchanged.
const ON_TIME: f64 = 0.2;
/// Rates with a smaller relative difference count as equal, because two clocks do not agree better
/// than this.
const CLOCKS: f64 = 1e-3;
/// Relative difference of rates above which a trial is refused.
const OTHER_RATE: f64 = 0.05;
/// If there are more gaps than this, one note summarizes all of them.
const TOLD: usize = 3;
/// Smallest change of a valve opening that counts as a switch. A smaller change may be noise, and then the value on
/// either side bridges a gap well enough.
const SWITCH: f64 = 0.05;
/// Channels whose values a device holds until the next sample: commands of the valves.
const HELD: [&str; 2] = ["inlet", "outlet"];

/// Settings for resampling a trial to a uniform grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvenSpec {
    /// Sample rate of the grid, Hz.
    pub rate_hz: f64,
    /// Parts between gaps, and whole trials, with fewer samples than this are left out.
    pub shortest: usize,
    /// Longest gap that is bridged, s, if the commands are equal before and after it. With equal commands, gaps of up
    /// to three samples are always bridged.
    pub bridged_s: f64,
    /// Whether up to three missing samples are bridged even if a valve switched during the gap, at
    /// an unknown time.
    pub over_switches: bool,
}

/// Counts of a trial's rows: read, bridged, left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rows {
    /// Rows that were read.
    pub read: usize,
    /// Lost samples that were bridged.
    pub bridged: usize,
    /// Rows left out because their part between two gaps is too short.
    pub dropped: usize,
}

impl Rows {
    /// Returns the number of rows that are used.
    pub fn used(&self) -> usize {
        self.read - self.dropped
    }

    /// Adds the counts of another trial.
    pub fn add(&mut self, other: Self) {
        self.read += other.read;
        self.bridged += other.bridged;
        self.dropped += other.dropped;
    }

    /// Returns the counts as a sentence, or `None` if every row was used and no sample was bridged. A row that the reader
    /// left out is not counted, because the reader reports it.
    pub fn note(&self) -> Option<String> {
        let Self { read, bridged, dropped } = self;
        let unused = (*dropped > 0).then(|| {
            format!(
                "{dropped} of {read} rows are not used, because they lie in short parts between gaps"
            )
        });
        let lost = (*bridged > 0).then(|| {
            let samples = if *bridged == 1 { "sample is" } else { "samples are" };
            format!(
                "{bridged} lost {samples} bridged, measured channels by linear interpolation, commands by their last value"
            )
        });
        let all: Vec<String> = unused.into_iter().chain(lost).collect();
        (!all.is_empty()).then(|| all.join("; "))
    }
}

/// A part of a trial without gaps, on a uniform grid.
#[derive(Debug, Clone, PartialEq)]
pub struct EvenPart {
    /// Start of the part, s after the trial's first sample.
    pub begin_s: f64,
    /// Values of the requested columns, in the requested order; all have the same length.
    pub columns: Vec<Vec<f64>>,
    /// For each sample, whether it was lost, so that its value was filled in.
    pub is_lost: Vec<bool>,
}

impl EvenPart {
    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A trial on a uniform grid, with a report of the changes that were made.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Even {
    /// The trial, or its parts between gaps.
    pub parts: Vec<EvenPart>,
    /// Counts of the trial's rows.
    pub rows: Rows,
    /// For each column that was unwrapped, the size of a turn in the column's unit.
    pub turns: Vec<Option<f64>>,
    /// Sentences about the gaps at which the trial is split.
    pub gaps: Vec<String>,
    /// Notes: parts left out, uneven time stamps, wrapped angles. Empty if nothing had to be
    /// changed.
    pub notes: Vec<String>,
}

impl Trial {
    /// Resamples columns of the trial to a uniform grid.
    ///
    /// - Samples within a fifth of a period of a grid point are taken unchanged.
    /// - Up to three consecutive lost samples are bridged; over a switch of a valve only with
    ///   [`EvenSpec::over_switches`]. The channels `inlet` and `outlet` are commands, which the
    ///   valves hold, so they keep their last value. All other channels are measured and are
    ///   interpolated linearly. A live receptor instead extrapolates its last sample with the last
    ///   rate, because it does not know the next sample. In a log the next sample is known, and
    ///   interpolation cannot overshoot.
    /// - A longer gap, up to [`EvenSpec::bridged_s`], is bridged in the same way if the commands on
    ///   both sides of it are equal.
    /// - Longer gaps split the trial. Parts with fewer than [`EvenSpec::shortest`] samples are left
    ///   out.
    /// - A column that jumps by a full turn although the motion continues is a wrapped angle
    ///   ([`Wrap`](crate::Wrap)); it is unwrapped.
    /// - Trials with uneven time stamps are resampled: measured channels by linear interpolation,
    ///   commands by the value that holds in the middle of each period.
    /// # Errors
    /// A missing column; a column with another length than the time, or with a value that is not
    /// finite; time that does not increase; a rate that is not above zero; a trial whose rate
    /// differs from the grid's by more than 5 %.
    ///
    /// ```
    /// use stretch_data::{Channel, EvenSpec, Trial};
    /// let time_s = vec![0.0, 0.01, 0.03, 0.04]; // the sample at 0.02 was lost
    /// let channel = |name: &str, values| Channel { name: name.into(), values };
    /// let length = channel("length_mm", vec![180.0, 179.0, 177.0, 176.0]);
    /// let inlet = channel("inlet", vec![0.5, 0.5, 0.0, 0.0]);
    /// let trial = Trial { name: "a.csv".into(), time_s, channels: vec![length, inlet] };
    /// let spec = EvenSpec { rate_hz: 100.0, shortest: 2, bridged_s: 0.0, over_switches: true };
    /// let even = trial.even(&["length_mm", "inlet"], spec)?;
    /// assert_eq!(even.parts[0].columns[0], [180.0, 179.0, 178.0, 177.0, 176.0]);
    /// assert_eq!(even.parts[0].columns[1], [0.5, 0.5, 0.5, 0.0, 0.0]);
    /// assert_eq!((even.rows.read, even.rows.bridged), (4, 1));
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn even(&self, columns: &[&str], spec: EvenSpec) -> Result<Even, DataError> {
        self.check_samples()?;
        let unwrapped = columns.iter().map(|name| self.unwrapped(name));
        let (values, wraps): (Vec<_>, Vec<_>) =
            unwrapped.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let is_held: Vec<bool> = columns.iter().map(|name| HELD.contains(name)).collect();
        let own_hz = self.rate_hz().unwrap_or(spec.rate_hz);
        let ratio = own_hz / spec.rate_hz;
        if !(spec.rate_hz.is_finite() && (ratio - 1.0).abs() <= OTHER_RATE) {
            return Err(DataError::OtherRate {
                trial: self.name.clone(),
                rate_hz: own_hz,
                usual_hz: spec.rate_hz,
            });
        }
        let is_own = (ratio - 1.0).abs() < CLOCKS;
        let clock = Clock {
            period_s: 1.0 / if is_own { own_hz } else { spec.rate_hz },
            own_s: 1.0 / own_hz,
        };
        let mut even = Even::default();
        even.rows.read = self.len();
        let noted =
            columns.iter().zip(&wraps).filter_map(|(name, wrap)| Some(wrap.as_ref()?.note(name)));
        even.notes.extend(noted.map(|note| format!("{}: {note}", self.name)));
        even.turns = wraps.iter().map(|wrap| wrap.map(|wrap| wrap.turn)).collect();
        let changed = |i: usize| {
            let held = values.iter().zip(&is_held).filter(|(_, held)| **held);
            held.map(|(column, _)| (column[i] - column[i - 1]).abs()).fold(0.0, f64::max)
        };
        let most = |i: usize| match changed(i) {
            0.0 => ((spec.bridged_s / clock.own_s).round() as usize).max(MOST_BRIDGED),
            change if change > SWITCH && !spec.over_switches => 0,
            _ => MOST_BRIDGED,
        };
        let stretches = clock.stretches(&self.time_s, most);
        even.tell_gaps(self, &stretches, clock.own_s);
        let mut is_uneven = false;
        for stretch in stretches {
            if stretch.len() < spec.shortest {
                even.rows.dropped += stretch.len();
                even.notes.push(format!(
                    "{}: the {} samples from {:.2} s on are left out because they are too few",
                    self.name,
                    stretch.len(),
                    self.time_s[stretch.start]
                ));
                continue;
            }
            let time_s = &self.time_s[stretch.clone()];
            even.rows.bridged += clock.lost(time_s);
            let points = clock.points(time_s);
            is_uneven |= points.is_none();
            let points = points.unwrap_or_else(|| clock.grid(time_s));
            let filled = |(all, held): (&Cow<'_, [f64]>, &bool)| {
                let own = &all[stretch.clone()];
                points.iter().map(|point| point.value(own, *held)).collect()
            };
            even.parts.push(EvenPart {
                begin_s: time_s[0] - self.time_s[0],
                columns: values.iter().zip(&is_held).map(filled).collect(),
                is_lost: points.iter().map(|p| clock.is_lost(time_s, p)).collect(),
            });
        }
        if is_uneven {
            even.notes.push(format!(
                "{}: its samples are spaced unevenly; they are resampled to one every {:.4} s by linear interpolation",
                self.name, clock.period_s
            ));
        }
        Ok(even)
    }
}

impl Even {
    fn tell_gaps(&mut self, trial: &Trial, stretches: &[Range<usize>], own_s: f64) {
        let gaps: Vec<(f64, f64)> = stretches
            .windows(2)
            .map(|pair| {
                let (last_s, next_s) = (trial.time_s[pair[0].end - 1], trial.time_s[pair[1].start]);
                (next_s - last_s - own_s, last_s)
            })
            .collect();
        let name = &trial.name;
        match &gaps[..] {
            [] => {}
            [(_, first_s), ..] if gaps.len() > TOLD => self.gaps.push(format!(
                "{name}: {:.3} s are missing in {} gaps, the first after {first_s:.2} s; each part between gaps is treated as a separate trial",
                gaps.iter().map(|(lost_s, _)| lost_s).sum::<f64>(),
                gaps.len()
            )),
            _ => self.gaps.extend(gaps.iter().map(|(lost_s, at_s)| {
                format!(
                    "{name}: {lost_s:.3} s are missing after {at_s:.2} s; the part after the gap is treated as a separate trial"
                )
            })),
        }
    }
}

/// Sample periods of the grid and of a trial's recorder, s.
#[derive(Debug, Clone, Copy)]
struct Clock {
    period_s: f64,
    own_s: f64,
}

/// A grid point and the samples from which its values are computed.
#[derive(Debug, Clone, Copy)]
struct Point {
    /// Index of the last sample at or before the grid point.
    left: usize,
    /// Fraction of the way to the next sample, 0..1.
    way: f64,
    /// Index of the sample whose command holds at the grid point.
    holds: usize,
}

impl Point {
    fn value(&self, samples: &[f64], is_held: bool) -> f64 {
        let left = samples[self.left];
        match samples.get(self.left + 1) {
            _ if is_held => samples[self.holds],
            Some(right) if self.way > 0.0 => left + self.way * (right - left),
            _ => left,
        }
    }
}

impl Clock {
    /// Returns the number of samples that were lost between two consecutive samples.
    fn between(&self, step_s: f64) -> usize {
        ((step_s / self.own_s).round() as usize).saturating_sub(1)
    }

    fn lost(&self, time_s: &[f64]) -> usize {
        time_s.windows(2).map(|t| self.between(t[1] - t[0])).sum()
    }

    /// Whether a grid point lies within a gap.
    fn is_lost(&self, time_s: &[f64], point: &Point) -> bool {
        let next = time_s.get(point.left + 1);
        next.is_some_and(|t| point.way > 0.0 && self.between(t - time_s[point.left]) > 0)
    }

    /// Splits a trial at gaps that are not bridged. `most(i)` is the largest number of lost samples
    /// before sample `i` that is bridged.
    fn stretches(&self, time_s: &[f64], most: impl Fn(usize) -> usize) -> Vec<Range<usize>> {
        let is_gap = |i: &usize| self.between(time_s[*i] - time_s[*i - 1]) > most(*i);
        let mut out = Vec::new();
        let mut from = 0;
        for cut in (1..time_s.len()).filter(is_gap).chain([time_s.len()]) {
            if cut > from {
                out.push(from..cut);
            }
            from = cut;
        }
        out
    }

    /// Returns a grid on which every sample has a separate point, or `None` if the time stamps
    /// deviate too much from it.
    fn points(&self, time_s: &[f64]) -> Option<Vec<Point>> {
        let mut points: Vec<Point> = Vec::with_capacity(time_s.len());
        let (mut early, mut late) = (0.0_f64, 0.0_f64);
        for (i, t) in time_s.iter().enumerate() {
            let periods = (t - time_s[0]) / self.period_s;
            let slot = periods.round() as usize;
            (early, late) = (early.min(periods - slot as f64), late.max(periods - slot as f64));
            // The first sample may itself be early or late, so the range of the deviations counts.
            if slot < points.len() || late - early > 2.0 * ON_TIME {
                return None;
            }
            let lost = (slot + 1 - points.len()) as f64;
            for step in 1..slot + 1 - points.len() {
                points.push(Point { left: i - 1, way: step as f64 / lost, holds: i - 1 });
            }
            if slot >= points.len() {
                points.push(Point { left: i, way: 0.0, holds: i });
            }
        }
        Some(points)
    }

    /// Returns a uniform grid over unevenly spaced samples.
    fn grid(&self, time_s: &[f64]) -> Vec<Point> {
        let last = time_s.len() - 1;
        // The small number keeps rounding from dropping the last sample.
        let count = ((time_s[last] - time_s[0]) / self.period_s + 1e-6) as usize + 1;
        let (mut left, mut holds) = (0, 0);
        (0..count)
            .map(|k| {
                let t = time_s[0] + k as f64 * self.period_s;
                while left < last && time_s[left + 1] <= t {
                    left += 1;
                }
                while holds < last && time_s[holds + 1] <= t + 0.5 * self.period_s {
                    holds += 1;
                }
                let step_s = time_s.get(left + 1).map_or(f64::INFINITY, |next| next - time_s[left]);
                Point { left, way: ((t - time_s[left]) / step_s).clamp(0.0, 1.0), holds }
            })
            .collect()
    }
}
