//! The measured session: trials as a rig needs them, checked.

use std::path::Path;

use stretch_data::{DataSet, ReadOptions, Split, Trial, TrialKind};

use super::smooth::{Smoothed, schedule};
use crate::error::BenchError;

/// A measured trial of the rig.
#[derive(Debug, Clone)]
pub struct RigTrial {
    /// Name: the file's.
    pub name: String,
    /// What was done in it.
    pub kind: TrialKind,
    /// Session time of its first sample, s.
    pub start_s: f64,
    /// Whether it is a test trial.
    pub is_test: bool,
    /// Sample time, s.
    pub dt_s: f64,
    /// Inlet opening, 0..1.
    pub inlet: Vec<f64>,
    /// Outlet opening, 0..1.
    pub outlet: Vec<f64>,
    /// Gauge pressure, kPa, when recorded.
    pub pressure_kpa: Option<Vec<f64>>,
    /// Measured length, mm.
    pub length_mm: Vec<f64>,
    /// Bridge voltage, V.
    pub bridge_v: Vec<f64>,
}

/// A session and what was noticed while it was read.
#[derive(Debug, Clone)]
pub struct Session {
    /// Trials in the order in which they were recorded.
    pub trials: Vec<RigTrial>,
    /// Sentences for the report.
    pub notes: Vec<String>,
}

impl Session {
    /// Reads every trial of a data set.
    ///
    /// A trial with a gap in time is cut there. Without a test trial nothing is held back here (the diagnosis then
    /// tests on the last part of each trial).
    ///
    /// # Errors
    /// Files that cannot be read, columns that are missing or are not what their names say.
    pub fn read(folder: &Path, set: &DataSet) -> Result<Self, BenchError> {
        let mut trials = Vec::new();
        let mut notes = Vec::new();
        for entry in &set.trials {
            let trial = entry.load(folder, &ReadOptions::new())?;
            let is_test = entry.split == Split::Test;
            trials.push(rig_trial(trial, entry.kind, entry.start_s, is_test, &mut notes)?);
        }
        let mut session = Self { trials, notes };
        session.order();
        session.check()?;
        Ok(session)
    }

    /// A session from trials in memory.
    ///
    /// # Errors
    /// As [`Session::read`].
    pub fn new(trials: Vec<RigTrial>) -> Result<Self, BenchError> {
        let mut session = Self { trials, notes: Vec::new() };
        session.order();
        session.check()?;
        Ok(session)
    }

    /// Where no session time is known, pauses of 15 s are assumed.
    fn order(&mut self) {
        let rising = self.trials.windows(2).all(|t| t[1].start_s > t[0].start_s);
        if rising || self.trials.len() < 2 {
            return;
        }
        if self.trials.iter().any(|t| t.start_s != self.trials[0].start_s) {
            self.trials.sort_by(|a, b| a.start_s.total_cmp(&b.start_s));
        }
        if self.trials.windows(2).all(|t| t[1].start_s > t[0].start_s) {
            self.notes.push("the trials are taken in the order of their start_s".into());
            return;
        }
        self.notes.push(
            "the trials give no rising start_s: pauses of 15 s in the order of the file are assumed"
                .into(),
        );
        let mut at = 0.0;
        for trial in &mut self.trials {
            trial.start_s = at;
            at += trial.length_mm.len() as f64 * trial.dt_s + 15.0;
        }
    }

    fn check(&mut self) -> Result<(), BenchError> {
        if self.trials.iter().all(|t| t.is_test) {
            return Err(BenchError::TooLittle {
                what: "no trial may be fitted".into(),
                hint: "give at least one trial split = \"fit\"".into(),
            });
        }
        let fit: usize = self.trials.iter().filter(|t| !t.is_test).map(|t| t.inlet.len()).sum();
        if fit < 300 {
            return Err(BenchError::TooLittle {
                what: format!("the trials to fit have {fit} samples"),
                hint: "at least 300 are needed to tell anything".into(),
            });
        }
        let with = self.trials.iter().filter(|t| t.pressure_kpa.is_some()).count();
        if with > 0 && with < self.trials.len() {
            self.notes.push(format!(
                "only {with} of {} trials have a pressure column: it is left out",
                self.trials.len()
            ));
            self.trials.iter_mut().for_each(|t| t.pressure_kpa = None);
        }
        let dt_s = self.trials[0].dt_s;
        if let Some(other) = self.trials.iter().find(|t| (t.dt_s / dt_s - 1.0).abs() > 0.01) {
            return Err(BenchError::Implausible {
                column: format!("time_s of {}", other.name),
                found: format!("a sample every {} s where {dt_s} s is usual", other.dt_s),
                hint: "all trials need the same sample rate: convert them first".into(),
            });
        }
        self.check_units()
    }

    fn range(&self, column: impl Fn(&RigTrial) -> &[f64]) -> (f64, f64) {
        self.trials
            .iter()
            .flat_map(|t| column(t).iter())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)))
    }

    fn check_units(&mut self) -> Result<(), BenchError> {
        let length = self.range(|t| &t.length_mm);
        let volts = self.range(|t| &t.bridge_v);
        let bad = |column: &str, found: String, hint: &str| {
            Err(BenchError::Implausible { column: column.into(), found, hint: hint.into() })
        };
        let spread = |(low, high): (f64, f64)| format!("values from {low} to {high}");
        if length.1 < 10.0 && volts.1 > 10.0 {
            let hint = "length_mm and bridge_v look swapped: exchange the two names";
            return bad("length_mm", spread(length), hint);
        }
        if length.1 < 1.0 && length.0 > 0.0 {
            return bad("length_mm", spread(length), "this looks like metres: multiply by 1000");
        }
        if volts.1 > 50.0 {
            return bad("bridge_v", spread(volts), "this looks like millivolts: divide by 1000");
        }
        for (column, range) in [("length_mm", length), ("bridge_v", volts)] {
            if range.1 - range.0 <= 0.0 {
                let hint = "the channel is dead: check the sensor and its cable";
                return bad(column, format!("{} in every sample", range.0), hint);
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
            if pressure.1 > 10_000.0 {
                return bad("pressure_kpa", spread(pressure), "this looks like Pa: divide by 1000");
            }
            if pressure.1 < 20.0 {
                return bad("pressure_kpa", spread(pressure), "this looks like bar: times 100");
            }
        }
        self.check_directions()
    }
}

/// Share of one stroke at the widest opening that must go against the valves before their columns look exchanged.
const AGAINST: f64 = 0.5;

impl Session {
    /// An open inlet shortens the muscle, an open outlet lets it out; and no channel stands still while the muscle moves.
    fn check_directions(&self) -> Result<(), BenchError> {
        let span = |values: &[f64]| {
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - low
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
                    return Err(BenchError::Implausible {
                        column: format!("{}, {column}", trial.name),
                        found: format!("{} in every sample, while the muscle moves", values[0]),
                        hint: "the channel is dead: check the sensor and its cable".into(),
                    });
                }
            }
        }
        if against > AGAINST * widest * stroke {
            return Err(BenchError::Implausible {
                column: "inlet, outlet".into(),
                found: "the muscle lengthens while the inlet is open".into(),
                hint: "they look swapped: exchange the two names".into(),
            });
        }
        Ok(())
    }
}

fn rig_trial(
    trial: Trial,
    kind: TrialKind,
    start_s: f64,
    is_test: bool,
    notes: &mut Vec<String>,
) -> Result<RigTrial, BenchError> {
    let dt_s = trial.rate_hz().map_or(0.01, |rate| 1.0 / rate);
    let mut samples = trial.len();
    if let Some(gap) = trial.time_s.windows(2).position(|t| t[1] - t[0] > 1.6 * dt_s) {
        notes.push(format!(
            "{}: {:.3} s are missing after {:.2} s; the trial is cut there",
            trial.name,
            trial.time_s[gap + 1] - trial.time_s[gap] - dt_s,
            trial.time_s[gap]
        ));
        samples = gap + 1;
    }
    let column = |name: &str| -> Result<Vec<f64>, BenchError> {
        match trial.channel(name) {
            Some(values) => Ok(values[..samples].to_vec()),
            None => Err(BenchError::MissingColumn {
                trial: trial.name.clone(),
                column: name.into(),
                needs: "a diagnosis of the whole rig needs",
            }),
        }
    };
    Ok(RigTrial {
        kind,
        start_s,
        is_test,
        dt_s,
        inlet: column("inlet")?,
        outlet: column("outlet")?,
        pressure_kpa: trial.channel("pressure_kpa").map(|p| p[..samples].to_vec()),
        length_mm: column("length_mm")?,
        bridge_v: column("bridge_v")?,
        name: trial.name,
    })
}

/// How the chamber begins a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Begin {
    /// Vented: at the atmosphere, as a rule a little above.
    Empty,
    /// Filled: settled at the supply, as a rule a little below.
    Full,
    /// At a measured gauge pressure, kPa, known to so many kPa.
    Pressure(f64, f64),
    /// At the pressure that belongs to a measured length, mm.
    Length(f64),
}

/// Measured inputs smoothed, and how every trial begins.
#[derive(Debug, Clone)]
pub(crate) struct Inputs {
    pub(crate) length: Vec<Smoothed>,
    pub(crate) pressure: Vec<Smoothed>,
    pub(crate) begin: Vec<Begin>,
    /// Shortest and longest length of the session, mm.
    pub(crate) stroke: (f64, f64),
}

impl Inputs {
    pub(crate) fn of(session: &Session, length_sd: f64, pressure_sd: f64, supply_kpa: f64) -> Self {
        let smooth = |trial: &RigTrial, record: &[f64], sd: f64, sharp: bool| {
            let allowed = schedule(&trial.inlet, &trial.outlet, trial.dt_s, sharp);
            Smoothed::of(record, sd, &allowed)
        };
        let trials = &session.trials;
        let length: Vec<_> =
            trials.iter().map(|t| smooth(t, &t.length_mm, length_sd, false)).collect();
        let stroke = length
            .iter()
            .flat_map(|l| &l.values)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
        let pressure = trials
            .iter()
            .filter_map(|t| t.pressure_kpa.as_ref().map(|p| smooth(t, p, pressure_sd, true)))
            .collect();
        let begin =
            trials.iter().map(|t| Self::begin(t, stroke, pressure_sd, supply_kpa)).collect();
        Self { length, pressure, begin, stroke }
    }

    fn begin(trial: &RigTrial, stroke: (f64, f64), pressure_sd: f64, supply_kpa: f64) -> Begin {
        // The rest at the trial's start, at most a fifth of a second of it.
        let longest = ((0.2 / trial.dt_s) as usize).max(1);
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
