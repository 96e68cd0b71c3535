//! Facts about a recording that a simulator may state in addition to stages, parameters, effects
//! and trials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::problem::{
    checks::{DescriptionError, check_parameter, indices, number},
    column::Column,
    spec::ParameterSpec,
};

/// The measured motion. Reports divide the gap by direction, level and rate of this motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// Values, all trials concatenated.
    pub values: &'a [f64],
    /// Unit.
    pub unit: &'a str,
    /// Word for a motion whose values fall.
    pub falling: &'a str,
    /// Word for a motion whose values rise.
    pub rising: &'a str,
}

/// A signal that was recorded in addition to the outputs, or that is fed to a stage. A missing term
/// may be a function of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Name of the column.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Values, all trials concatenated. A measured signal is smoothed as far as its noise allows,
    /// because terms use its rate.
    pub values: Vec<f64>,
    /// Whether the signal is a command. A command may jump, and zero means that the actuator does
    /// nothing.
    pub is_command: bool,
}

impl Recorded {
    /// Creates a signal that is not a command.
    pub fn measured(name: &str, unit: &str, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), values, is_command: false }
    }
}

/// The motion of a recording, all trials concatenated, and the words for falling and rising.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionSpec {
    /// Values.
    pub values: Vec<f64>,
    /// Unit.
    pub unit: String,
    /// Word for a motion whose values fall.
    pub falling: String,
    /// Word for a motion whose values rise.
    pub rising: String,
}

impl MotionSpec {
    /// Creates a motion with the words "falling" and "rising".
    pub fn new(values: Vec<f64>, unit: &str) -> Self {
        Self { values, unit: unit.into(), falling: "falling".into(), rising: "rising".into() }
    }

    pub(crate) fn as_ref(&self) -> Motion<'_> {
        let Self { values, unit, falling, rising } = self;
        Motion { values, unit, falling, rising }
    }
}

/// Returns the nouns of sentences for the simulator and for the machine that was recorded.
///
/// ```
/// assert_eq!(stretch_gap::nouns(false), ["simulator", "rig"]);
/// assert_eq!(stretch_gap::nouns(true), ["calibration line", "gauge"]);
/// ```
pub const fn nouns(gauge_alone: bool) -> [&'static str; 2] {
    if gauge_alone { ["calibration line", "gauge"] } else { ["simulator", "rig"] }
}

/// Facts about a recording in addition to a [`DescriptionSpec`](crate::DescriptionSpec); empty by
/// default.
///
/// [`Description::with_record`](crate::Description::with_record) checks them. A field with one
/// value per sample covers the samples of all trials, concatenated.
///
/// ```
/// use stretch_gap::{Description, DescriptionSpec, RecordFacts, StageSpec, TrialSpec};
///
/// let description = Description::new(DescriptionSpec {
///     stages: vec![StageSpec::new("spring", "length_mm", "mm", &[])],
///     parameters: vec![],
///     effects: vec![],
///     trials: vec![TrialSpec::new("monday", 3, 0.0, false)],
///     dt_s: 0.01,
/// })?;
/// let is_lost = vec![false, true, false];
/// let known = RecordFacts { is_lost, ..RecordFacts::default() };
/// assert_eq!(description.clone().with_record(known)?.record().is_lost, [false, true, false]);
/// let known = RecordFacts { sensor: Some(1), ..RecordFacts::default() };
/// let error = description.with_record(known).unwrap_err();
/// assert_eq!(error.to_string(), "record: stage 1 is not among the 1 stages; count from 0");
/// # Ok::<(), stretch_gap::DescriptionError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RecordFacts {
    /// Flags of samples that were not measured. These samples are ignored, whatever their value.
    /// Empty if all samples were measured.
    pub is_lost: Vec<bool>,
    /// Whether a gauge was recorded alone, so that there is neither a rig nor a simulator of one.
    pub gauge_alone: bool,
    /// Number of rows of the recording in the trials, and number of rows that were read; `None` if
    /// every row that was read is a sample of a trial.
    pub rows_used: Option<RowsUsed>,
    /// The motion by which the gap is divided into regimes, levels and rates; `None` if it is the
    /// output of the first stage.
    pub motion: Option<MotionSpec>,
    /// The signals that a missing term may depend on. If the list is empty, the inputs of the
    /// stages are used, each named after the channel of the previous stage; if no stage has an
    /// input, the motion is used.
    pub signals: Vec<Recorded>,
    /// Columns of the recording, without values for the outputs of stages. Empty if the outputs are
    /// the only columns.
    pub columns: Vec<Column<'static>>,
    /// The stage whose output a calibration converts back into the motion; `None` if there is no
    /// such sensor.
    pub sensor: Option<usize>,
    /// Largest remaining misfit that causes no warning, as a share of a channel's variance.
    pub gross_misfit_share: f64,
    /// Parameters, by index, that describe when commands switch. They are exact if commands switch
    /// at rows of the recording. The second element is the specification of the parameter if
    /// commands switch anywhere between two rows. The diagnosis compares both cases. Empty if
    /// commands are not held constant from row to row.
    ///
    /// Variation from one switch to the next is described [per tick](ParameterSpec::per_tick_sd).
    pub command_timing: Vec<(usize, ParameterSpec)>,
    /// Clocks of parameters, by index, with one value for every sample. If the slow drift of a
    /// parameter cannot reach the outputs at certain times, the clock is the last sample so far
    /// (counted from the trial's start) at which it could. If a parameter has an [offset for each
    /// tick](ParameterSpec::per_tick_sd), the clock counts the ticks.
    pub drift_clocks: Vec<(usize, Vec<u32>)>,
}

impl Default for RecordFacts {
    fn default() -> Self {
        Self {
            is_lost: Vec::new(),
            gauge_alone: false,
            rows_used: None,
            motion: None,
            signals: Vec::new(),
            columns: Vec::new(),
            sensor: None,
            gross_misfit_share: 0.1,
            command_timing: Vec::new(),
            drift_clocks: Vec::new(),
        }
    }
}

impl RecordFacts {
    /// Returns the clock of a parameter's slow drift; `None` if the drift always affects the
    /// outputs.
    pub(crate) fn drift_clock(&self, parameter: usize) -> Option<&[u32]> {
        let own = self.drift_clocks.iter().find(|(p, _)| *p == parameter)?;
        Some(&own.1)
    }

    /// Checks the facts against the numbers of stages and parameters, and the number of samples in
    /// all trials.
    pub(crate) fn check(
        &self,
        stages: usize,
        parameters: usize,
        samples: usize,
    ) -> Result<(), DescriptionError> {
        let owner = || "record".to_owned();
        let whole = |what, found: usize| {
            number(&owner, what, found as f64, "equal to the number of samples", |_| {
                found == samples
            })
        };
        if !self.is_lost.is_empty() {
            whole("the number of flags of lost samples", self.is_lost.len())?;
        }
        if let Some(motion) = &self.motion {
            whole("the number of values of the motion", motion.values.len())?;
        }
        for signal in &self.signals {
            whole("the number of values of a signal", signal.values.len())?;
        }
        for (p, clock) in &self.drift_clocks {
            indices(&owner, "parameter", &[*p], parameters)?;
            whole("the number of ticks of a drift clock", clock.len())?;
        }
        for (p, between_rows) in &self.command_timing {
            indices(&owner, "parameter", &[*p], parameters)?;
            check_parameter(between_rows)?;
        }
        for column in &self.columns {
            indices(&owner, "stage", &column.read_by, stages)?;
            indices(&owner, "stage", column.output_of.as_slice(), stages)?;
        }
        indices(&owner, "stage", self.sensor.as_slice(), stages)?;
        let share = self.gross_misfit_share;
        number(&owner, "gross_misfit_share", share, "above 0", |x| x > 0.0)
    }
}

/// Number of rows that the trials contain, and of rows that were read.
///
/// ```
/// let rows = stretch_gap::RowsUsed { used: 120, read: 1000 };
/// assert_eq!(rows.share(), 0.12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct RowsUsed {
    /// Rows in the trials, which the diagnosis uses.
    pub used: usize,
    /// Rows read.
    pub read: usize,
}

impl RowsUsed {
    /// Returns the share of the rows that is used; 1 if no rows were read.
    pub fn share(&self) -> f64 {
        if self.read == 0 { 1.0 } else { self.used as f64 / self.read as f64 }
    }
}
