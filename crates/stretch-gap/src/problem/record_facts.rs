//! What is known of a record beside stages, parameters, effects and trials.

use crate::problem::{
    checks::{DescriptionError, check_parameter, indices, number},
    column::Column,
    rows_used::RowsUsed,
    spec::ParameterSpec,
};

/// The measured motion that slices go by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// All trials end to end.
    pub values: &'a [f64],
    /// Unit.
    pub unit: &'a str,
    /// Word for a motion whose values fall.
    pub falling: &'a str,
    /// Word for a motion whose values rise.
    pub rising: &'a str,
}

/// A signal that was recorded beside the outputs, or is fed to a stage: what a missing term may be a function of.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Column.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Values, all trials end to end; a measured one smoothed as far as its noise allows, for terms use its rate.
    pub values: Vec<f64>,
    /// Whether it is commanded: it may jump, and its zero means that nothing is done.
    pub is_command: bool,
}

impl Recorded {
    /// A signal that is no command.
    pub fn measured(name: &str, unit: &str, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), values, is_command: false }
    }
}

/// The motion that a record holds, all trials end to end, and what it is called when it falls and when it rises.
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
    /// A motion that falls and rises.
    pub fn new(values: Vec<f64>, unit: &str) -> Self {
        Self { values, unit: unit.into(), falling: "falling".into(), rising: "rising".into() }
    }

    pub(crate) fn as_ref(&self) -> Motion<'_> {
        let Self { values, unit, falling, rising } = self;
        Motion { values, unit, falling, rising }
    }
}

/// What is known of a record beside what a [`DescriptionSpec`](crate::DescriptionSpec) says; by default nothing more is known.
///
/// [`Description::with_record`](crate::Description::with_record) checks it. All that has a value for each sample counts the samples of
/// all trials end to end.
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
    /// Samples that were not measured, whatever stands in their place: they count for nothing. Empty where all were measured.
    pub is_lost: Vec<bool>,
    /// Rows that the trials stand on, of those that were read; none where every sample is a row.
    pub rows_used: Option<RowsUsed>,
    /// The motion by which the gap is cut into regimes, levels and rates; none where it is the first stage's output.
    pub motion: Option<MotionSpec>,
    /// Everything that a missing term may be a function of; empty where that is what the stages are fed with, under the name of the
    /// channel before, or the motion where they are fed with nothing.
    pub signals: Vec<Recorded>,
    /// Columns of the record, without values where they are the output of a stage; empty where there are no others than outputs.
    pub columns: Vec<Column<'static>>,
    /// The stage whose output a user turns back into the motion with a calibration; none where there is no such sensor.
    pub sensor: Option<usize>,
    /// Share of a channel's variance that may be left before the names of effects mean nothing.
    pub gross_misfit_share: f64,
    /// Parameters, by index, that are exact while commands switch at rows of the record, and what they are where commands switch
    /// anywhere between two rows; the diagnosis weighs both. Empty where commands are not held from row to row.
    ///
    /// What differs from switch to switch is [per tick](ParameterSpec::per_tick_sd).
    pub command_timing: Vec<(usize, ParameterSpec)>,
    /// Parameters, by index, whose slow drift has no way into the outputs at times: the sample, counted from the trial's start, at which
    /// it last had one.
    pub drift_clocks: Vec<(usize, Vec<u32>)>,
}

impl Default for RecordFacts {
    fn default() -> Self {
        Self {
            is_lost: Vec::new(),
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
    /// The clock of a parameter's slow drift; none where it always has a way into the outputs.
    pub(crate) fn drift_clock(&self, parameter: usize) -> Option<&[u32]> {
        let own = self.drift_clocks.iter().find(|(p, _)| *p == parameter)?;
        Some(&own.1)
    }

    /// Whether the facts fit so many stages, parameters, and samples of all trials.
    pub(crate) fn check(
        &self,
        stages: usize,
        parameters: usize,
        samples: usize,
    ) -> Result<(), DescriptionError> {
        let owner = || "record".to_owned();
        let whole = |what, found: usize| {
            number(&owner, what, found as f64, "that of the samples", |_| found == samples)
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
