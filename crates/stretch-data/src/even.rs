//! A trial on an even grid of time: lost samples bridged, long gaps cut.

use std::{borrow::Cow, ops::Range};

use crate::{DataError, Trial};

/// Lost samples in a row that are bridged, as a live receptor bridges them; one more cuts the trial.
const MOST_BRIDGED: usize = 3;
/// A sample is on time within so many periods.
const ON_TIME: f64 = 0.2;
/// Rates that differ by less than this share are one: no two clocks agree better.
const CLOCKS: f64 = 1e-3;
/// A rate that differs by more than this share is another rate.
const OTHER_RATE: f64 = 0.05;
/// More gaps than these are reported in one sentence.
const TOLD: usize = 3;
/// Change of an opening that is a switch: one sample of it is more than noise. What is smaller is bridged well by whatever holds.
const SWITCH: f64 = 0.05;
/// Channels that a device holds from one sample to the next: commands of the valves.
const HELD: [&str; 2] = ["inlet", "outlet"];

/// How a trial is brought onto an even grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvenSpec {
    /// Samples a second of the grid.
    pub rate_hz: f64,
    /// Parts between two gaps with fewer samples are left out, and so is a trial.
    pub shortest: usize,
    /// Longest gap that is bridged, s, where the commands are the same on both sides of it; three samples always are then.
    pub bridged_s: f64,
    /// Whether up to three missing samples are bridged even if a valve switched meanwhile at an unknown time.
    pub over_switches: bool,
}

/// What became of a trial's rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Rows {
    /// Rows that were read.
    pub read: usize,
    /// Samples that were lost and are bridged.
    pub bridged: usize,
    /// Rows left out: parts between gaps that are too short.
    pub dropped: usize,
}

impl Rows {
    /// Rows that are used.
    pub fn used(&self) -> usize {
        self.read - self.dropped
    }

    /// Adds those of another trial.
    pub fn add(&mut self, other: Self) {
        self.read += other.read;
        self.bridged += other.bridged;
        self.dropped += other.dropped;
    }

    /// A sentence, unless every row was used as it is and none was lost.
    pub fn note(&self) -> Option<String> {
        let Self { read, bridged, dropped } = self;
        (bridged + dropped > 0).then(|| {
            format!(
                "rows: {} of {read} used, {dropped} left out; {bridged} lost samples bridged, \
                 measured channels by straight lines and commands held",
                read - dropped
            )
        })
    }
}

/// A part of a trial without a gap, on an even grid.
#[derive(Debug, Clone, PartialEq)]
pub struct EvenPart {
    /// When it begins, s after the trial's first sample.
    pub begin_s: f64,
    /// Values of the columns that were asked for, in that order; all of one length.
    pub columns: Vec<Vec<f64>>,
    /// Samples that were lost and bridged.
    pub is_lost: Vec<bool>,
}

impl EvenPart {
    /// How many samples it has.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A trial on an even grid, and what had to be done for it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Even {
    /// The trial, or its parts between gaps.
    pub parts: Vec<EvenPart>,
    /// What became of its rows.
    pub rows: Rows,
    /// By column, the turn by which it wrapped, in its unit: its values are unwrapped.
    pub turns: Vec<Option<f64>>,
    /// Sentences: gaps, parts left out, uneven time stamps, angles that wrapped. Empty if the trial was even.
    pub notes: Vec<String>,
}

impl Trial {
    /// Brings columns of the trial onto an even grid.
    ///
    /// - Samples within a fifth of a period of the grid are taken as they are.
    /// - Up to three lost samples in a row are bridged, over a switch of a valve only with [`EvenSpec::over_switches`]. The
    ///   channels `inlet` and `outlet` are commands, which the valves hold: they keep their last value. Anything else is
    ///   measured and goes straight from the sample before the gap to the one behind it. A live receptor moves its last
    ///   sample on by the last rate instead: it cannot see what comes, a log can, and a line between two samples cannot
    ///   overshoot.
    /// - So is a longer gap up to [`EvenSpec::bridged_s`] where the commands behind it are those before it.
    /// - More lost samples cut the trial; parts with fewer than [`EvenSpec::shortest`] samples are left out.
    /// - A column that jumps by a turn where the motion goes on is an angle that wraps ([`Wrap`](crate::Wrap)); it is unwrapped.
    /// - Uneven stamps are resampled: measured channels by straight lines, of the commands the one that holds in the middle
    ///   of each period.
    ///
    /// # Errors
    /// A column that is missing, of another length than the time, or holds what is no finite number; time that does
    /// not rise; a rate that is not above zero; a trial whose rate is off by more than a twentieth.
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
                    "{}: the {} samples from {:.2} s on are too few and left out",
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
                "{}: its samples come unevenly; they are resampled to every {:.4} s by straight lines",
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
            [(_, first_s), ..] if gaps.len() > TOLD => self.notes.push(format!(
                "{name}: {:.3} s are missing in {} gaps, the first after {first_s:.2} s; each part between them is a trial of its own",
                gaps.iter().map(|(lost_s, _)| lost_s).sum::<f64>(),
                gaps.len()
            )),
            _ => self.notes.extend(gaps.iter().map(|(lost_s, at_s)| {
                format!(
                    "{name}: {lost_s:.3} s are missing after {at_s:.2} s; the part behind the gap is a trial of its own"
                )
            })),
        }
    }
}

/// Periods of a trial's own clock and of the grid, s.
#[derive(Debug, Clone, Copy)]
struct Clock {
    period_s: f64,
    own_s: f64,
}

/// A point of the grid between two samples of a stretch.
#[derive(Debug, Clone, Copy)]
struct Point {
    /// The sample at or before it.
    left: usize,
    /// How far towards the next sample it lies, 0..1.
    way: f64,
    /// The sample whose command holds.
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
    /// Samples that were lost between two neighbours.
    fn between(&self, step_s: f64) -> usize {
        ((step_s / self.own_s).round() as usize).saturating_sub(1)
    }

    fn lost(&self, time_s: &[f64]) -> usize {
        time_s.windows(2).map(|t| self.between(t[1] - t[0])).sum()
    }

    /// Whether a point lies within a gap.
    fn is_lost(&self, time_s: &[f64], point: &Point) -> bool {
        let next = time_s.get(point.left + 1);
        next.is_some_and(|t| point.way > 0.0 && self.between(t - time_s[point.left]) > 0)
    }

    /// Parts between gaps that are not bridged: `most` says how many samples may be lost before a sample.
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

    /// The grid with every sample on a separate point; `None` if one comes too early or too late for that.
    fn points(&self, time_s: &[f64]) -> Option<Vec<Point>> {
        let mut points: Vec<Point> = Vec::with_capacity(time_s.len());
        let (mut early, mut late) = (0.0_f64, 0.0_f64);
        for (i, t) in time_s.iter().enumerate() {
            let periods = (t - time_s[0]) / self.period_s;
            let slot = periods.round() as usize;
            (early, late) = (early.min(periods - slot as f64), late.max(periods - slot as f64));
            // The first sample may itself be off: the range counts.
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

    /// The grid between samples that come unevenly.
    fn grid(&self, time_s: &[f64]) -> Vec<Point> {
        let last = time_s.len() - 1;
        // Rounding must not cost the last sample.
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
