//! A session: the trials of a data set on one uniform time grid, in the order in which they were
//! recorded.

use std::collections::HashMap;

use crate::{DataError, EvenSpec, Rows, Split, Trial, TrialKind};

/// Assumed pause between trials whose start times are unknown, s.
const PAUSE_S: f64 = 15.0;
/// Relative rounding error of time stamps: a rate this close to an integer in hertz is taken as
/// that integer.
const STAMPED: f64 = 1e-6;
/// Longest gap that is bridged if the commands on both sides are equal, s. A command that changes
/// and returns within such a gap is rare.
const BRIDGED_S: f64 = 0.5;

/// A trial and its place in a session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionTrial {
    /// The recorded data.
    pub trial: Trial,
    /// Kind of motion in the trial.
    pub kind: TrialKind,
    /// Session time of its first sample, s.
    pub start_s: f64,
    /// Whether the trial may be fitted, or only used for testing.
    pub split: Split,
    /// Notes of the reader: what had to be changed to read the trial.
    pub notes: Vec<String>,
}

impl SessionTrial {
    /// Returns a trial that may be fitted and starts at session time 0. Set the other fields as
    /// needed.
    pub fn new(trial: Trial) -> Self {
        let notes = Vec::new();
        Self { trial, kind: TrialKind::Other, start_s: 0.0, split: Split::Fit, notes }
    }
}

/// A trial of an [`EvenSession`]: columns on a uniform grid, without gaps.
#[derive(Debug, Clone, PartialEq)]
pub struct EvenTrial {
    name: String,
    source: usize,
    kind: TrialKind,
    start_s: f64,
    split: Split,
    columns: Vec<Vec<f64>>,
    is_lost: Vec<bool>,
}

impl EvenTrial {
    /// Returns the trial's name. Parts of a trial with gaps are numbered.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the index of the original trial in the list given to `EvenSession::new`.
    pub fn source(&self) -> usize {
        self.source
    }

    /// Returns what was done in the trial.
    pub fn kind(&self) -> TrialKind {
        self.kind
    }

    /// Returns the session time of the first sample, s.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Whether the trial is a test trial.
    pub fn is_test(&self) -> bool {
        self.split == Split::Test
    }

    /// Returns the columns in the requested order; all values are finite and all lengths equal.
    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// For each sample, whether it was lost and its value bridges a gap.
    pub fn is_lost(&self) -> &[bool] {
        &self.is_lost
    }
}

/// Refuses a test trial whose requested columns have the same checksum as those of a trial that may
/// be fitted, whatever its name.
fn check_splits(trials: &[SessionTrial], columns: &[&str]) -> Result<(), DataError> {
    let of = |split| {
        let own = trials.iter().filter(move |t| t.split == split);
        own.filter_map(|t| Some((t.trial.checksum(columns)?, &t.trial.name)))
    };
    let fitted: HashMap<u32, &String> = of(Split::Fit).collect();
    match of(Split::Test).find_map(|(sum, test)| Some((fitted.get(&sum)?, test))) {
        Some((fit, test)) => {
            Err(DataError::FittedAndTested { fit: (*fit).clone(), test: test.clone() })
        }
        None => Ok(()),
    }
}

/// Trials on one uniform grid, in order of time: the input of simulation and diagnosis.
///
/// ```
/// use stretch_data::{Channel, EvenSession, SessionTrial, Trial};
/// // Eight tenths of a second are missing after 0.99 s.
/// let time_s: Vec<f64> = (0..300).filter(|i| !(100..180).contains(i)).map(|i| 0.01 * i as f64).collect();
/// let values = time_s.iter().map(|t| 180.0 - t).collect();
/// let channels = vec![Channel { name: "length_mm".into(), values }];
/// let trial = Trial { name: "a.csv".into(), time_s, channels };
/// let trials = [SessionTrial { start_s: 40.0, ..SessionTrial::new(trial) }];
/// let session = EvenSession::new(&trials, &["length_mm"], 50)?;
/// let starts: Vec<f64> = session.trials().iter().map(|t| t.start_s()).collect();
/// assert_eq!(starts, [40.0, 41.8]);
/// assert_eq!(session.trials()[1].name(), "a.csv (part 2)");
/// assert_eq!(
///     session.notes(),
///     ["a.csv: 0.800 s are missing after 0.99 s; the part after the gap is treated as a separate trial"]
/// );
/// # Ok::<(), stretch_data::DataError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct EvenSession {
    trials: Vec<EvenTrial>,
    dt_s: f64,
    rows: Rows,
    turns: Vec<Option<f64>>,
    notes: Vec<String>,
}

impl EvenSession {
    /// Resamples columns of trials to one uniform grid, as [`Trial::even`] does. The first trial's rate is the
    /// session's rate.
    ///
    /// Trials are sorted by `start_s`. If start times are equal, the given order is kept, and pauses of 15 s are
    /// assumed. Gaps of up to half a second are bridged if the commands are equal on both sides. A gap during which a
    /// valve switched is not bridged, because the time of the switch is unknown, and an error of the flow during one
    /// sample changes the air in the chamber for seconds. Parts of a trial with gaps start at their true times and
    /// inherit the trial's kind and split.
    ///
    /// # Errors
    /// No trial with two samples; a test trial with the same samples as a trial that may be fitted;
    /// errors of [`Trial::even`].
    pub fn new(
        trials: &[SessionTrial],
        columns: &[&str],
        shortest: usize,
    ) -> Result<Self, DataError> {
        let rate_hz = trials.iter().find_map(|t| t.trial.rate_hz()).ok_or(DataError::NoSamples)?;
        check_splits(trials, columns)?;
        // Time stamps are rounded. A rate of 100 Hz is computed as 100.000000000002 Hz, and a count
        // of samples would be too small by one.
        let whole = rate_hz.round();
        let is_whole = whole > 0.0 && (rate_hz / whole - 1.0).abs() < STAMPED;
        let rate_hz = if is_whole { whole } else { rate_hz };
        let (dt_s, rows) = (1.0 / rate_hz, Rows::default());
        let (turns, notes) = (vec![None; columns.len()], Vec::new());
        let mut session = Self { trials: Vec::new(), dt_s, rows, turns, notes };
        for (one, start_s) in session.in_order(trials) {
            let spec = EvenSpec { rate_hz, shortest, bridged_s: BRIDGED_S, over_switches: false };
            let even = one.trial.even(columns, spec)?;
            let count = even.parts.len();
            let notes = one.notes.iter().map(|note| format!("{}: {note}", one.trial.name));
            session.notes.extend(notes);
            session.rows.add(even.rows);
            session.notes.extend(even.gaps.into_iter().chain(even.notes));
            let turns = session.turns.iter_mut().zip(even.turns);
            turns.for_each(|(known, turn)| *known = known.or(turn));
            session.trials.extend(even.parts.into_iter().enumerate().map(|(i, part)| EvenTrial {
                name: match count {
                    1 => one.trial.name.clone(),
                    _ => format!("{} (part {})", one.trial.name, i + 1),
                },
                source: trials.iter().position(|t| std::ptr::eq(t, one)).unwrap_or(0),
                kind: one.kind,
                start_s: start_s + part.begin_s,
                split: one.split,
                columns: part.columns,
                is_lost: part.is_lost,
            }));
        }
        session.notes.extend(session.rows.note());
        Ok(session)
    }

    /// Returns the trials in order of time, each with its start time.
    fn in_order<'a>(&mut self, trials: &'a [SessionTrial]) -> Vec<(&'a SessionTrial, f64)> {
        let mut order: Vec<_> = trials.iter().map(|t| (t, t.start_s)).collect();
        let rises = |order: &[(&SessionTrial, f64)]| order.windows(2).all(|t| t[1].1 > t[0].1);
        if rises(&order) {
            return order;
        }
        order.sort_by(|a, b| a.1.total_cmp(&b.1));
        if rises(&order) {
            self.notes.push("the trials are taken in the order of their start_s".into());
            return order;
        }
        let why = match order.iter().all(|(_, start_s)| *start_s == 0.0) {
            true => "no start_s of a trial is given",
            false => "start_s does not rise from trial to trial",
        };
        self.notes.push(format!("{why}: the given order and pauses of 15 s are assumed"));
        let mut at_s = 0.0;
        trials
            .iter()
            .map(|one| {
                let begun_s = at_s;
                at_s += one.trial.duration_s() + self.dt_s + PAUSE_S;
                (one, begun_s)
            })
            .collect()
    }

    /// Returns the trials, in order of time.
    pub fn trials(&self) -> &[EvenTrial] {
        &self.trials
    }

    /// Returns the sample period of all trials, s; above zero.
    pub fn dt_s(&self) -> f64 {
        self.dt_s
    }

    /// Returns the counts of rows of all trials.
    pub fn rows(&self) -> Rows {
        self.rows
    }

    /// For each column that was unwrapped in some trial, returns the size of a turn in the column's
    /// unit.
    pub fn turns(&self) -> &[Option<f64>] {
        &self.turns
    }

    /// Returns notes on all changes that were made to the trials. Empty for gap-free, evenly
    /// sampled trials with increasing start times.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}
