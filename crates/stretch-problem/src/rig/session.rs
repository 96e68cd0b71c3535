//! The measured session: trials as a rig needs them, checked.

use std::path::Path;

use stretch_calibrate::PRESSURE;
use stretch_data::{DataSet, EvenSession, EvenTrial, Rows, SessionTrial, Split, ends};
use stretch_gap::{copied, noise_variance};
use stretch_recording::{ReadOptions, Recording};

use super::directions::{self, Motion};
use super::smooth::{Draws, Smoothed, schedule};
use super::timing::{is_slow, switched};
use crate::{
    bench::{
        isolated_outliers::without_isolated_outliers,
        shortened::shortened,
        undetermined::{undetermined, undetermined_behind_gap},
    },
    error::{ProblemError, check_rate},
};

/// Columns that a rig needs; the pressure is optional.
const NEEDED: [&str; 4] = ["inlet", "outlet", "length_mm", "bridge_v"];
/// Simulated outputs: pressure, length and voltage.
const OUTPUTS: usize = 3;
/// Column of the bridge's excitation, a share of the nominal one, the same throughout a trial; 1 if
/// it is missing.
const EXCITATION: &str = "excitation_share";
/// Parts of a trial with fewer samples are left out.
const SHORTEST: usize = 100;
/// Range that noise alone hardly ever reaches, standard deviations.
const NOISE_SPAN: f64 = 15.0;
/// Smallest number of samples to fit.
const LEAST: usize = 300;

/// A measured trial of the rig, on the session's even grid; all channels have the same length.
#[derive(Debug, Clone)]
pub struct RigTrial {
    pub(super) name: String,
    pub(super) start_s: f64,
    pub(super) is_test: bool,
    pub(super) inlet: Vec<f64>,
    pub(super) outlet: Vec<f64>,
    pub(super) pressure_kpa: Option<Vec<f64>>,
    pub(super) length_mm: Vec<f64>,
    pub(super) bridge_v: Vec<f64>,
    /// Marks samples that were lost, and samples that a gap before them leaves undetermined.
    pub(super) is_lost: Vec<bool>,
    /// Whether the trial continues the trial before it after a gap.
    goes_on: bool,
    /// Excitation of the bridge, a share of the nominal one.
    pub(super) excitation: f64,
}

impl RigTrial {
    /// The trial of a session whose columns are [`NEEDED`], followed by the pressure if there is one; `before` is the
    /// trial before it.
    fn of(trial: &EvenTrial, before: Option<&EvenTrial>, excitation: f64, dt_s: f64) -> Self {
        let goes_on = before.is_some_and(|before| before.source() == trial.source());
        let column = |i: usize| trial.columns().get(i).cloned();
        let needed = |i: usize| column(i).unwrap_or_default();
        Self {
            name: trial.name().to_owned(),
            start_s: trial.start_s(),
            is_test: trial.is_test(),
            inlet: needed(0),
            outlet: needed(1),
            length_mm: needed(2),
            bridge_v: needed(3),
            pressure_kpa: column(4),
            is_lost: match goes_on {
                true => undetermined_behind_gap(trial.is_lost(), dt_s),
                false => undetermined(trial.is_lost()),
            },
            goes_on,
            excitation,
        }
    }

    /// Gauge pressure, kPa, if every trial of the session has one.
    pub fn pressure_kpa(&self) -> Option<&[f64]> {
        self.pressure_kpa.as_deref()
    }

    /// Measured length, mm.
    pub fn length_mm(&self) -> &[f64] {
        &self.length_mm
    }

    /// Bridge voltage, V.
    pub fn bridge_v(&self) -> &[f64] {
        &self.bridge_v
    }
}

/// A measured session of the rig, with notes on the reading: at least one trial, and at least one that may be fitted.
#[derive(Debug, Clone)]
pub struct RigSession {
    pub(super) trials: Vec<RigTrial>,
    dt_s: f64,
    pub(super) rows: Rows,
    pub(super) notes: Vec<String>,
}

impl RigSession {
    /// Reads every trial of a data set.
    ///
    /// # Errors
    /// Files that cannot be read, and as [`RigSession::new`].
    pub fn read(folder: &Path, set: &DataSet, recorded: ReadOptions) -> Result<Self, ProblemError> {
        let options = NEEDED.iter().fold(recorded, |options, name| options.require(*name));
        Self::new(&Recording::session(set, folder, &options)?)
    }

    /// Binds trials with the columns `inlet`, `outlet` (0..1), `length_mm`, `bridge_v` and, if it
    /// was recorded, `pressure_kpa`. The trials are brought onto one even grid ([`EvenSession`]):
    /// lost samples are bridged, a long gap in time splits a trial into two, and the notes name
    /// both. Without a test trial nothing is held back here: the diagnosis then tests on the last
    /// part of each trial.
    ///
    /// # Errors
    /// Columns that are missing or whose values do not fit their names, trials of different rates,
    /// too few samples to fit.
    pub fn new(trials: &[SessionTrial]) -> Result<Self, ProblemError> {
        let (trials, cut) = shortened(trials, OUTPUTS)?;
        let with = trials.iter().filter(|t| t.trial.channel(PRESSURE).is_some()).count();
        let mut columns = NEEDED.to_vec();
        if with == trials.len() {
            columns.push(PRESSURE);
        }
        if trials.iter().all(|t| t.split == Split::Test) {
            let hint = "give at least one trial that is not a test trial";
            return Err(ProblemError::too_little("no trial may be fitted", hint));
        }
        let shares: Vec<f64> = trials.iter().map(excitation).collect::<Result<_, _>>()?;
        // Outliers are replaced before resampling, because resampling would spread an outlier over
        // its neighbours.
        let (trials, outlier_notes) = without_isolated_outliers(trials.into_owned());
        let trials = &trials[..];
        let even = EvenSession::new(trials, &columns, SHORTEST)?;
        check_rate(even.dt_s())?;
        let before = std::iter::once(None).chain(even.trials().iter().map(Some));
        let of =
            |(t, before): (&EvenTrial, _)| RigTrial::of(t, before, shares[t.source()], even.dt_s());
        let mut session = Self {
            trials: even.trials().iter().zip(before).map(of).collect(),
            dt_s: even.dt_s(),
            rows: even.rows(),
            notes: cut
                .into_iter()
                .chain(even.notes().iter().cloned())
                .chain(outlier_notes)
                .collect(),
        };
        if with > 0 && with < trials.len() {
            session.notes.push(format!(
                "only {with} of {} trials have a pressure column: it is left out",
                trials.len()
            ));
        }
        session.check()?;
        Ok(session)
    }

    /// The trials, in the order of time.
    pub fn trials(&self) -> &[RigTrial] {
        &self.trials
    }

    /// Notes on the reading, in sentences for a report.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Sample time of every trial, s.
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    fn check(&self) -> Result<(), ProblemError> {
        let fit: usize = self.trials.iter().filter(|t| !t.is_test).map(|t| t.inlet.len()).sum();
        if fit < LEAST {
            return Err(ProblemError::few_samples(fit, LEAST));
        }
        self.check_units()
    }

    fn range(&self, column: impl Fn(&RigTrial) -> &[f64]) -> (f64, f64) {
        ends(self.trials.iter().flat_map(column))
    }

    /// Whether the voltage is a copy of another column. The diagnosis reports a copy, so its unit
    /// is not checked.
    fn is_copied(&self) -> bool {
        let all = |of: fn(&RigTrial) -> &[f64]| -> Vec<f64> {
            self.trials.iter().flat_map(of).copied().collect()
        };
        let volts = all(|t| &t.bridge_v);
        let others = [all(|t| &t.length_mm), all(|t| t.pressure_kpa.as_deref().unwrap_or(&[]))];
        others.iter().any(|other| copied(other, &volts).is_some())
    }

    /// Whether a column with this range holds nothing but noise.
    fn is_noise<'a>(&self, trials: impl Iterator<Item = &'a [f64]>, span: f64) -> bool {
        span < NOISE_SPAN * noise_variance(trials, self.dt_s).sqrt()
    }

    fn check_units(&self) -> Result<(), ProblemError> {
        let length = self.range(|t| &t.length_mm);
        let volts = self.range(|t| &t.bridge_v);
        let bad =
            |column: &str, found: String, hint: &str| Err(ProblemError::value(column, found, hint));
        let spread = |(low, high): (f64, f64)| format!("values from {low} to {high}");
        if length.1 < 10.0 && volts.1 > 10.0 {
            let hint = "length_mm and bridge_v look swapped: exchange the two names";
            return bad("length_mm", spread(length), hint);
        }
        if length.1 < 1.0 && length.0 > 0.0 {
            return bad("length_mm", spread(length), "this looks like metres: multiply by 1000");
        }
        if volts.1 > 50.0 && !self.is_copied() {
            return bad("bridge_v", spread(volts), "this looks like millivolts: divide by 1000");
        }
        for (column, range) in [("length_mm", length), ("bridge_v", volts)] {
            if range.1 - range.0 <= 0.0 {
                return Err(ProblemError::dead(column, format!("{} in every sample", range.0)));
            }
        }
        let openings = (self.range(|t| &t.inlet), self.range(|t| &t.outlet));
        for (column, range) in [("inlet", openings.0), ("outlet", openings.1)] {
            if range.0 < 0.0 || range.1 > 1.0 {
                return bad(column, spread(range), "an opening is a number from 0 to 1");
            }
        }
        if openings.0.1 <= 0.0 && openings.1.1 <= 0.0 {
            let hint = "no valve ever opens: check the columns inlet and outlet";
            return bad("inlet, outlet", "0 in every sample".into(), hint);
        }
        if self.trials[0].pressure_kpa.is_some() {
            let pressure = self.range(|t| t.pressure_kpa.as_deref().unwrap_or(&[]));
            if pressure.1 - pressure.0 <= 0.0 {
                let hint = "the channel is dead: check the sensor, or take the column out";
                return bad("pressure_kpa", format!("{} in every sample", pressure.0), hint);
            }
            // Noise alone does not show a unit; the diagnosis reports that the channel is dead.
            let pressures = self.trials.iter().filter_map(|t| t.pressure_kpa.as_deref());
            if self.is_noise(pressures, pressure.1 - pressure.0) {
                return self.check_directions();
            }
            if pressure.1 > 10_000.0 {
                return bad("pressure_kpa", spread(pressure), "this looks like Pa: divide by 1000");
            }
            if pressure.1 < 20.0 {
                return bad(
                    "pressure_kpa",
                    spread(pressure),
                    "this looks like bar: multiply by 100",
                );
            }
        }
        self.check_directions()
    }
}

/// Share of the nominal excitation that a trial was recorded at.
fn excitation(one: &SessionTrial) -> Result<f64, ProblemError> {
    let Some(shares) = one.trial.channel(EXCITATION) else { return Ok(1.0) };
    let share = shares.first().copied().unwrap_or(1.0);
    let is_sound = share > 0.0 && share <= 2.0 && shares.iter().all(|s| *s == share);
    is_sound.then_some(share).ok_or_else(|| {
        let (low, high) = ends(shares);
        ProblemError::value(
            format!("{}, {EXCITATION}", one.trial.name),
            format!("values from {low} to {high}"),
            "give the share of the nominal excitation, one number in every row of a trial",
        )
    })
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
        let (mut against, mut widest, mut stroke) = (0.0, 0.0_f64, 0.0_f64);
        for trial in &self.trials {
            let valves =
                trial.inlet.iter().zip(&trial.outlet).map(|(inlet, outlet)| inlet - outlet);
            for (open, pair) in valves.zip(trial.length_mm.windows(2)) {
                against += open * (pair[1] - pair[0]);
                widest = widest.max(open.abs());
            }
            let moved = span(&trial.length_mm);
            stroke = stroke.max(moved);
            let others = [
                ("bridge_v", Some(trial.bridge_v.as_slice())),
                ("pressure_kpa", trial.pressure_kpa.as_deref()),
            ];
            for (column, values) in others {
                if let Some(values) = values.filter(|values| moved > 1.0 && span(values) <= 0.0) {
                    let found = format!("{} in every sample, while the muscle moves", values[0]);
                    return Err(ProblemError::dead(format!("{}, {column}", trial.name), found));
                }
            }
        }
        // Noise alone does not show a direction; the diagnosis reports that the channel is dead.
        let lengths = self.trials.iter().map(|t| t.length_mm.as_slice());
        if against > AGAINST * widest * stroke && !self.is_noise(lengths, stroke) {
            let motions = self.trials.iter().map(|t| Motion {
                inlet: &t.inlet,
                outlet: &t.outlet,
                pressure_kpa: t.pressure_kpa.as_deref(),
                length_mm: &t.length_mm,
            });
            let (column, hint) = directions::against(&motions.collect::<Vec<_>>(), self.dt_s);
            let found = "the muscle lengthens while the inlet is open";
            return Err(ProblemError::value(column, found, hint));
        }
        Ok(())
    }
}

/// The state of the chamber at the start of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Begin {
    /// The chamber is vented: its pressure is that of the atmosphere, as a rule a little above.
    Empty,
    /// The chamber is filled: its pressure has settled at the supply, as a rule a little below.
    Full,
    /// The gauge pressure was measured: its value and its standard deviation, kPa.
    Pressure(f64, f64),
    /// The pressure is the one at which the muscle rests at a measured length, mm.
    Length(f64),
    /// The muscle is moving, at a measured length (mm) and rate (mm/s).
    Moving(f64, f64),
}

/// The smoothed measured inputs, and the state of the chamber at the start of every trial.
#[derive(Debug, Clone)]
pub(crate) struct Inputs {
    pub(crate) length: Vec<Smoothed>,
    pub(crate) length_draws: Draws,
    pub(crate) pressure: Vec<Smoothed>,
    pub(crate) pressure_draws: Draws,
    pub(crate) begin: Vec<Begin>,
    /// Shortest and longest length of the session, mm.
    pub(crate) stroke: (f64, f64),
}

impl Inputs {
    pub(crate) fn of(
        session: &RigSession,
        length_sd: f64,
        pressure_sd: f64,
        supply_kpa: f64,
    ) -> Self {
        let smooth = |trial: &RigTrial, record: &[f64], sd: f64, sharp: bool| {
            let allowed = schedule(&trial.inlet, &trial.outlet, session.dt_s, sharp);
            let smoothed = Smoothed::of(record, sd, &allowed);
            match sharp && is_slow(session.dt_s) {
                true => smoothed.cornered(switched(&trial.inlet, &trial.outlet)),
                false => smoothed,
            }
        };
        let trials = &session.trials;
        let length: Vec<_> =
            trials.iter().map(|t| smooth(t, &t.length_mm, length_sd, false)).collect();
        let stroke = ends(length.iter().flat_map(|l| &l.values));
        let pressure = trials
            .iter()
            .filter_map(|t| t.pressure_kpa.as_ref().map(|p| smooth(t, p, pressure_sd, true)))
            .collect();
        let begin = trials
            .iter()
            .map(|t| Self::begin(t, session.dt_s, stroke, pressure_sd, supply_kpa))
            .collect();
        let [length_draws, pressure_draws] = [Draws::new(), Draws::new()];
        Self { length, length_draws, pressure, pressure_draws, begin, stroke }
    }

    fn begin(
        trial: &RigTrial,
        dt_s: f64,
        stroke: (f64, f64),
        pressure_sd: f64,
        supply_kpa: f64,
    ) -> Begin {
        // The number of samples at rest at the trial's start, over at most a fifth of a second.
        let longest = ((0.2 / dt_s) as usize).max(1);
        let shut = trial.inlet.iter().zip(&trial.outlet).take_while(|(i, o)| **i + **o == 0.0);
        let rest = shut.count().clamp(1, longest).min(trial.length_mm.len());
        let mean = |x: &[f64]| x[..rest].iter().sum::<f64>() / rest as f64;
        if let Some(pressure) = &trial.pressure_kpa {
            let found = mean(pressure);
            let sd = pressure_sd / (rest as f64).sqrt();
            if found.abs() < 4.0 * sd + 2.0 {
                return Begin::Empty;
            }
            if (found / supply_kpa - 1.0).abs() < 0.035 {
                return Begin::Full;
            }
            return Begin::Pressure(found, sd);
        }
        if trial.goes_on {
            let (mm, per_sample) = line(&trial.length_mm[..LINE.min(trial.length_mm.len())]);
            return Begin::Moving(mm, per_sample / dt_s);
        }
        let found = mean(&trial.length_mm);
        let whole = stroke.1 - stroke.0;
        if found > stroke.1 - 0.05 * whole {
            Begin::Empty
        } else if found < stroke.0 + 0.05 * whole {
            Begin::Full
        } else {
            Begin::Length(found)
        }
    }
}

/// Number of samples at the beginning of a part from which its motion is estimated.
const LINE: usize = 9;

/// First value and slope (for each sample) of the straight line through values, by least squares.
fn line(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let middle = 0.5 * (n - 1.0);
    let mean = values.iter().sum::<f64>() / n;
    let (mut along, mut square) = (0.0, 0.0);
    for (i, x) in values.iter().enumerate() {
        let t = i as f64 - middle;
        along += t * x;
        square += t * t;
    }
    let slope = if square > 0.0 { along / square } else { 0.0 };
    (mean - slope * middle, slope)
}
