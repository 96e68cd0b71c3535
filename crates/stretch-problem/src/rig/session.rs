//! The measured session: trials as a rig needs them, checked.

use std::ops::Range;

use stretch_calibrate::PRESSURE;
use stretch_data::{SessionTrial, ends};
use stretch_gap::{Noise, TrialSpec, copied, noise_variance};
use stretch_sim::excitation_share;

use super::{
    directions::{self, Motion},
    noises::Noises,
    timing::{is_slow, switched},
};
use crate::{
    bench::{
        columns::Columns,
        smooth::{MeasuredInput, Smoothed, schedule},
        straight_line,
    },
    error::ProblemError,
};

/// Columns of the valves' openings, of the length and of the bridge voltage.
pub(super) const VALVES: [&str; 2] = ["inlet", "outlet"];
pub(super) const LENGTH: &str = "length_mm";
pub(super) const VOLTAGE: &str = "bridge_v";
/// Columns that a rig needs; the pressure is optional.
pub(super) const NEEDED: [&str; 4] = [VALVES[0], VALVES[1], LENGTH, VOLTAGE];
/// Columns of sensors, each of which is a simulated output.
const MEASURED: [&str; 3] = [PRESSURE, LENGTH, VOLTAGE];
/// Range that noise alone hardly ever reaches, standard deviations.
const NOISE_SPAN: f64 = 15.0;

/// A measured session of the rig, with notes on the reading: at least one trial, and at least one that may be fitted.
#[derive(Debug, Clone)]
pub struct RigSession {
    pub(crate) columns: Columns,
    /// By trial, the excitation of the bridge as a share of the nominal one.
    pub(super) excitation: Vec<f64>,
}

impl RigSession {
    /// Binds trials with the columns `inlet`, `outlet` (0..1), `length_mm`, `bridge_v` and, if it
    /// was recorded, `pressure_kpa`. The trials are brought onto one even grid ([`EvenSession`](stretch_data::EvenSession)):
    /// lost samples are bridged, a long gap in time splits a trial into two, and the notes name
    /// both. A column `excitation_share` is the excitation of the bridge as a share of the nominal one, the same throughout a
    /// trial; 1 if it is missing. Without a test trial nothing is held back here: the diagnosis then tests on the last
    /// part of each trial.
    ///
    /// # Errors
    /// Columns that are missing or whose values do not fit their names, trials of different rates,
    /// too few samples to fit.
    pub fn new(trials: &[SessionTrial]) -> Result<Self, ProblemError> {
        let with = trials.iter().filter(|t| t.trial.channel(PRESSURE).is_some()).count();
        let has_pressure = with == trials.len();
        let names = NEEDED.into_iter().chain(has_pressure.then_some(PRESSURE)).map(str::to_owned);
        let mut columns =
            Columns::built_in(trials, names.collect(), &MEASURED, MEASURED.len(), true)?;
        if with > 0 && !has_pressure {
            columns.notes.push(format!(
                "only {with} of {} trials have a pressure column: it is left out",
                trials.len()
            ));
        }
        let share = |source: &usize| {
            let trial = &trials[*source].trial;
            let named = |error| ProblemError::Refused(format!("{}, {error}", trial.name));
            excitation_share(trial).map_err(named)
        };
        let excitation = columns.sources.iter().map(share).collect::<Result<_, _>>()?;
        let session = Self { columns, excitation };
        session.check_units()?;
        Ok(session)
    }

    /// The trials, in the order of time.
    pub fn trials(&self) -> &[TrialSpec] {
        &self.columns.trials
    }

    /// A column, all trials concatenated; empty for a pressure that was not recorded in every trial.
    pub fn column(&self, name: &str) -> &[f64] {
        self.columns.all(name)
    }

    /// Notes on the reading, in sentences for a report.
    pub fn notes(&self) -> &[String] {
        &self.columns.notes
    }

    /// Sample time of every trial, s.
    pub fn dt_s(&self) -> f64 {
        self.columns.dt_s
    }

    /// Whether the voltage is a copy of another column. The diagnosis reports a copy, so its unit
    /// is not checked.
    fn is_copied(&self) -> bool {
        let volts = self.column(VOLTAGE);
        [LENGTH, PRESSURE].iter().any(|other| copied(self.column(other), volts).is_some())
    }

    /// Whether a column with this range holds nothing but noise.
    fn is_noise(&self, column: &str, span: f64) -> bool {
        let values = self.column(column);
        let trials = self.columns.ranges.iter().map(|range| &values[range.clone()]);
        span < NOISE_SPAN * noise_variance(trials, self.dt_s()).sqrt()
    }

    fn check_units(&self) -> Result<(), ProblemError> {
        let range = |column: &str| ends(self.column(column));
        let (length, volts, pressure) = (range(LENGTH), range(VOLTAGE), range(PRESSURE));
        let has_pressure = self.columns.of(PRESSURE).is_some();
        let span = pressure.1 - pressure.0;
        for (column, range) in [(LENGTH, length), (VOLTAGE, volts), (PRESSURE, pressure)] {
            if range.1 <= range.0 && (column != PRESSURE || has_pressure) {
                return Err(ProblemError::dead(column, format!("{} in every sample", range.0)));
            }
        }
        // Noise alone does not show a unit; the diagnosis reports that the channel is dead.
        let shows_unit = has_pressure && !self.is_noise(PRESSURE, span);
        let openings = VALVES.map(range);
        let is_beyond = |(low, high): (f64, f64)| low < 0.0 || high > 1.0;
        let opening = "an opening is a number from 0 to 1";
        let is_shut = openings.iter().all(|range| range.1 <= 0.0);
        let wrong = [
            (
                length.1 < 10.0 && volts.1 > 10.0,
                (LENGTH, length),
                "length_mm and bridge_v look swapped: exchange the two names",
            ),
            (
                length.1 < 1.0 && length.0 > 0.0,
                (LENGTH, length),
                "this looks like metres: multiply by 1000",
            ),
            (
                volts.1 > 50.0 && !self.is_copied(),
                (VOLTAGE, volts),
                "this looks like millivolts: divide by 1000",
            ),
            (is_beyond(openings[0]), (VALVES[0], openings[0]), opening),
            (is_beyond(openings[1]), (VALVES[1], openings[1]), opening),
            (
                is_shut,
                ("inlet, outlet", openings[0]),
                "no valve ever opens: check the columns inlet and outlet",
            ),
            (
                shows_unit && pressure.1 > 10_000.0,
                (PRESSURE, pressure),
                "this looks like Pa: divide by 1000",
            ),
            (
                shows_unit && pressure.1 < 20.0,
                (PRESSURE, pressure),
                "this looks like bar: multiply by 100",
            ),
        ];
        match wrong.into_iter().find(|(is_wrong, ..)| *is_wrong) {
            None => self.check_directions(),
            Some((_, (column, (low, high)), hint)) => {
                Err(ProblemError::value(column, format!("values from {low} to {high}"), hint))
            }
        }
    }
}

/// Limit of the motion against the valves: a recording is refused if the muscle lengthens while the inlet is open, or
/// shortens while the outlet is open, by more than this many strokes at the widest opening.
const AGAINST: f64 = 0.5;

impl RigSession {
    /// Checks that an open inlet shortens the muscle and an open outlet lengthens it, and that no
    /// channel stays constant while the muscle moves.
    fn check_directions(&self) -> Result<(), ProblemError> {
        let span = |values: &[f64]| {
            let (low, high) = ends(values);
            high - low
        };
        let pressure = self.columns.of(PRESSURE);
        let [[inlet, outlet], [length, volts]] =
            [VALVES, [LENGTH, VOLTAGE]].map(|names| names.map(|name| self.column(name)));
        let (mut against, mut widest, mut stroke) = (0.0, 0.0_f64, 0.0_f64);
        let mut motions = Vec::new();
        for (trial, range) in self.trials().iter().zip(&self.columns.ranges) {
            let motion = Motion {
                inlet: &inlet[range.clone()],
                outlet: &outlet[range.clone()],
                pressure_kpa: pressure.map(|values| &values[range.clone()]),
                length_mm: &length[range.clone()],
            };
            let valves = motion.inlet.iter().zip(motion.outlet).map(|(i, o)| i - o);
            for (open, pair) in valves.zip(motion.length_mm.windows(2)) {
                against += open * (pair[1] - pair[0]);
                widest = widest.max(open.abs());
            }
            let moved = span(motion.length_mm);
            stroke = stroke.max(moved);
            let others = [(VOLTAGE, Some(&volts[range.clone()])), (PRESSURE, motion.pressure_kpa)];
            for (column, values) in others {
                if let Some(values) = values.filter(|values| moved > 1.0 && span(values) <= 0.0) {
                    let found = format!("{} in every sample, while the muscle moves", values[0]);
                    return Err(ProblemError::dead(format!("{}, {column}", trial.name), found));
                }
            }
            motions.push(motion);
        }
        // Noise alone does not show a direction; the diagnosis reports that the channel is dead.
        if against > AGAINST * widest * stroke && !self.is_noise(LENGTH, stroke) {
            let (column, hint) = directions::against(&motions, self.dt_s());
            let found = "the muscle lengthens while the inlet is open";
            return Err(ProblemError::value(column, found, hint));
        }
        Ok(())
    }
}

/// The state of the chamber at the start of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Begin {
    /// The chamber is vented: its pressure is usually a little above that of the atmosphere.
    Empty,
    /// The chamber is filled: its pressure has settled, usually a little below that of the supply.
    Full,
    /// The gauge pressure was measured: its value and its standard deviation, kPa.
    Pressure(f64, f64),
    /// The pressure is the one at which the muscle rests at a measured length, mm.
    Length(f64),
    /// The muscle is moving, at a measured length (mm) and rate (mm/s).
    Moving(f64, f64),
}

/// What drives the stages: commands, smoothed measured inputs, and the state of the chamber at the start of every trial.
#[derive(Debug, Clone)]
pub(super) struct Inputs {
    /// Inlet and outlet, all trials concatenated.
    pub(super) openings: [Vec<f64>; 2],
    pub(super) length: MeasuredInput,
    /// `None` if the pressure was not recorded.
    pub(super) pressure: Option<MeasuredInput>,
    pub(super) begin: Vec<Begin>,
    /// Shortest and longest length of the session, mm.
    pub(super) stroke: (f64, f64),
}

impl Inputs {
    /// The inputs of a recording; the noise of a `corrected` column is that of the channel divided by a factor.
    pub(super) fn of(
        columns: &Columns,
        noises: &Noises,
        corrected: Option<(&str, f64)>,
        supply_kpa: f64,
    ) -> Self {
        let divisor =
            |name: &str| corrected.filter(|(own, _)| *own == name).map_or(1.0, |own| own.1);
        let [inlet, outlet] = VALVES.map(|name| columns.all(name));
        let smooth = |name: &str, noise: &Noise, is_sharp: bool| {
            let (record, sd) = (columns.all(name), noise.sd() / divisor(name));
            let one = |range: &Range<usize>| {
                let [inlet, outlet] = [inlet, outlet].map(|valve| &valve[range.clone()]);
                let allowed = schedule(inlet, outlet, columns.dt_s, is_sharp);
                let smoothed = Smoothed::of(&record[range.clone()], sd, &allowed);
                match is_sharp && is_slow(columns.dt_s) {
                    true => smoothed.cornered(switched(inlet, outlet)),
                    false => smoothed,
                }
            };
            MeasuredInput::new(columns.ranges.iter().map(one).collect(), noise.clone())
        };
        let length = smooth(LENGTH, &noises.length_mm, false);
        let has_pressure = columns.of(PRESSURE).is_some();
        let pressure = has_pressure.then(|| smooth(PRESSURE, &noises.pressure_kpa, true));
        let stroke = ends(&length.values());
        let pressure_sd = noises.pressure_kpa.sd() / divisor(PRESSURE);
        let begin = (0..columns.trials.len())
            .map(|trial| begin(columns, trial, stroke, (pressure_sd, supply_kpa)))
            .collect();
        Self { openings: [inlet, outlet].map(<[f64]>::to_vec), length, pressure, begin, stroke }
    }
}

/// The state of the chamber at the start of a trial, from the standard deviation of the pressure and the supply, kPa.
fn begin(
    columns: &Columns,
    trial: usize,
    stroke: (f64, f64),
    (pressure_sd, supply_kpa): (f64, f64),
) -> Begin {
    let own = |name: &str| &columns.all(name)[columns.ranges[trial].clone()];
    let ([inlet, outlet], length) = (VALVES.map(own), own(LENGTH));
    // The number of samples at rest at the trial's start, over at most a fifth of a second.
    let longest = ((0.2 / columns.dt_s) as usize).max(1);
    let shut = inlet.iter().zip(outlet).take_while(|(i, o)| **i + **o == 0.0);
    let rest = shut.count().clamp(1, longest).min(length.len());
    let mean = |x: &[f64]| x[..rest].iter().sum::<f64>() / rest as f64;
    if columns.of(PRESSURE).is_some() {
        let found = mean(own(PRESSURE));
        let sd = pressure_sd / (rest as f64).sqrt();
        if found.abs() < 4.0 * sd + 2.0 {
            return Begin::Empty;
        }
        if (found / supply_kpa - 1.0).abs() < 0.035 {
            return Begin::Full;
        }
        return Begin::Pressure(found, sd);
    }
    if columns.goes_on(trial) {
        let first = || length.iter().take(LINE).enumerate().map(|(i, mm)| (i as f64, *mm));
        let (mm, per_sample) = straight_line(first, 0.0);
        return Begin::Moving(mm, per_sample / columns.dt_s);
    }
    let found = mean(length);
    let whole = stroke.1 - stroke.0;
    if found > stroke.1 - 0.05 * whole {
        Begin::Empty
    } else if found < stroke.0 + 0.05 * whole {
        Begin::Full
    } else {
        Begin::Length(found)
    }
}

/// Number of samples at the beginning of a part from which its motion is estimated.
const LINE: usize = 9;
