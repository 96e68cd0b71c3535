//! Gross errors of the recording and of the rig file, in numbers and in words, with what a user should
//! check.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stretch_data::{after_number, in_digits};

use crate::{
    fit::hypothesis::Hypothesis,
    problem::{
        altered::Altered, column::Column, description::Description, fault::Kind,
        record_facts::nouns, simulator::Simulator, spec::ParameterSpec,
    },
    record::units::units,
};

/// A kind of error of the recording or of the rig file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GrossKind {
    /// A column is scaled by a wrong factor.
    #[default]
    Scale,
    /// Simulator and recording differ by a factor that no sensor error explains: their units
    /// differ, or parameters of the simulator are wrong but fixed.
    Factor,
    /// A column has an offset.
    Offset,
    /// A column is late or early.
    Delay,
    /// A column has the wrong sign.
    Sign,
    /// A nominal parameter differs from the rig file.
    Parameter,
    /// A column is a copy of another.
    Copied,
    /// A column is constant while others move.
    Dead,
}

/// An error of the recording or of the rig file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Gross {
    /// The kind of error.
    pub what: GrossKind,
    /// Name of the column that is wrong.
    pub column: Option<String>,
    /// Name of the nominal parameter that is wrong.
    pub parameter: Option<String>,
    /// Ratio of the recorded column to the true channel, or of the rig's parameter to the value in
    /// the rig file.
    pub factor: Option<f64>,
    /// Offset of the column, in `unit`. If the column has the wrong sign, this is the sum of the
    /// recorded and the true value.
    pub offset: Option<f64>,
    /// Delay of the column, s.
    pub delay_s: Option<f64>,
    /// Value of the parameter in the rig file.
    pub says: Option<f64>,
    /// Estimated value of the parameter.
    pub found: Option<f64>,
    /// Unit of the column or the parameter.
    pub unit: String,
    /// The units that explain a factor of an output, the simulator's and the recording's: `rpm for
    /// rad/s`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub units: Option<String>,
    /// First trial in which the error occurs, for errors of limited duration.
    pub trial: Option<String>,
    /// Start of the first such stretch, s from the trial's start.
    pub from_s: Option<f64>,
    /// End of that stretch, s from the trial's start.
    pub to_s: Option<f64>,
    /// A sentence that describes the error.
    pub sentence: String,
    /// What a user should check.
    pub hint: String,
}

impl Gross {
    /// Whether the columns alone show the error, without a simulator.
    pub fn is_plain(&self) -> bool {
        matches!(self.what, GrossKind::Copied | GrossKind::Dead)
    }

    fn of_column(what: GrossKind, column: &Column<'_>, sentence: String) -> Self {
        let (name, unit) = (column.name.clone(), column.unit.clone().into_owned());
        let hint = format!("check {}", column.hint);
        Self { what, column: Some(name.into_owned()), unit, hint, sentence, ..Self::default() }
    }

    /// Creates the error that `column` is `factor` times `source`, including noise.
    pub(crate) fn copied(column: &Column<'_>, source: &Column<'_>, factor: f64) -> Self {
        let (copy, source, times) = (&column.name, &source.name, in_digits(factor, 4));
        let sentence = format!("{copy} is a copy of {source} ({times} times it, noise and all)");
        Self {
            factor: Some(factor),
            hint: "check which channels the recorder wrote into the two columns".into(),
            ..Self::of_column(GrossKind::Copied, column, sentence)
        }
    }

    /// Creates the error that a column is constant in `count` stretches; the arguments give the
    /// first of them.
    pub(crate) fn still(
        column: &Column<'_>,
        (trial, from_s, to_s): &(String, f64, f64),
        count: usize,
    ) -> Self {
        let more = match count - 1 {
            0 => String::new(),
            more => format!(", and {more} more times"),
        };
        let place = format!("{trial}, {from_s:.2} to {to_s:.2} s{more}");
        let sentence = format!("{} is constant while the others move ({place})", column.name);
        Self {
            trial: Some(trial.clone()),
            from_s: Some(*from_s),
            to_s: Some(*to_s),
            ..Self::of_column(GrossKind::Dead, column, sentence)
        }
    }

    /// Describes the error of the recording that a hypothesis assumes, with its size; `None` if it
    /// assumes none.
    pub(crate) fn found(suspect: &Altered<'_>, hypothesis: &Hypothesis) -> Option<Self> {
        let (fault, size) = suspect.error_of(&hypothesis.model)?;
        if let Kind::Parameter(p) = fault.kind {
            let value = hypothesis.model.parameters[p] * size;
            return Some(Self::of_parameter(suspect.description(), p, value));
        }
        let column = &suspect.columns[fault.column?];
        let name = &column.name;
        let found = |what, sentence| Self::of_column(what, column, sentence);
        Some(match fault.kind {
            Kind::Scale => {
                let sd = hypothesis.greatest_sd();
                let is_output = column.output_of.is_some();
                let units = units(1.0 / size, sd / size, &column.unit).filter(|_| is_output);
                let is_exact = suspect.description().spec().parameters.iter().all(|p| p.sd == 0.0);
                let scaled = if units.is_some() || fault.is_beyond(size) || is_exact && is_output {
                    Self::of_factor(column, size, units, is_exact)
                } else if size >= 1.0 {
                    found(GrossKind::Scale, format!("{name} looks {size:.3} times too large"))
                } else {
                    let sentence = format!("{name} looks {size:.3} times as large as it should be");
                    found(GrossKind::Scale, sentence)
                };
                Self { factor: Some(size), ..scaled }
            }
            Kind::Offset => {
                let side = if size > 0.0 { "high" } else { "low" };
                let (by, unit) = (in_digits(size.abs(), 4), after_number(&column.unit));
                let sentence = format!("{name} lies {by}{unit} too {side}");
                Self { offset: Some(size), ..found(GrossKind::Offset, sentence) }
            }
            Kind::Delay => {
                let side = if size > 0.0 { "late" } else { "early" };
                let sentence = format!("{name} comes {:.3} s {side}", size.abs());
                let hint = "check the clocks of the recorders, and filters before them".into();
                Self { delay_s: Some(size), hint, ..found(GrossKind::Delay, sentence) }
            }
            _ => {
                let sentence = format!("{name} is upside down: it falls where it should rise");
                let hint = format!("check the polarity: {}", column.hint);
                let (factor, offset) = (Some(-1.0), Some(size));
                Self { factor, offset, hint, ..found(GrossKind::Sign, sentence) }
            }
        })
    }

    /// Creates the error that simulator and recording of an output differ by a factor, because of
    /// other units, or because no parameter of the simulator may change (`is_exact`).
    fn of_factor(column: &Column<'_>, factor: f64, units: Option<String>, is_exact: bool) -> Self {
        let or = if is_exact { ", or give the parameters tolerances" } else { "" };
        let that_is = units.as_ref().map_or(String::new(), |units| format!(": that is {units}"));
        let (name, ratio) = (&column.name, in_digits(1.0 / factor, 4));
        let sentence = format!("the simulated {name} is {ratio} times the recording's{that_is}");
        let hint = format!("simulate in the unit of the recording, or convert the recording{or}");
        Self { units, hint, ..Self::of_column(GrossKind::Factor, column, sentence) }
    }

    /// Creates the error that a nominal parameter has another value.
    fn of_parameter(about: &Description, parameter: usize, value: f64) -> Self {
        let [simulator, rig] = nouns(about.record().gauge_alone);
        let ParameterSpec { name, unit, nominal, .. } = &about.spec().parameters[parameter];
        let (found, says, of) = (in_digits(value, 4), in_digits(*nominal, 4), after_number(unit));
        Self {
            what: GrossKind::Parameter,
            parameter: Some(name.clone()),
            factor: Some(value / nominal),
            says: Some(*nominal),
            found: Some(value),
            unit: unit.clone(),
            sentence: format!("{name} is {found}{of} on the {rig}, and {says} in the {simulator}"),
            hint: format!("correct the parameter of the {simulator}, or the setting of the {rig}"),
            ..Self::default()
        }
    }
}

/// Returns one sentence with the first error, its alternatives, and what a user should check.
pub(crate) fn sentence(gross: &[Gross], [simulator, rig]: [&str; 2]) -> String {
    let Some(first) = gross.first() else { return String::new() };
    let rest: Vec<&str> = gross[1..].iter().map(|g| g.sentence.as_str()).collect();
    let other = match (rest.is_empty(), first.is_plain()) {
        (true, _) => String::new(),
        (false, true) => format!("; {}", rest.join("; ")),
        (false, false) => format!(" (or {}: these data cannot tell)", rest.join(", or ")),
    };
    let wrong = match first.what {
        GrossKind::Parameter => &format!("A parameter of the {simulator} does not fit the {rig}"),
        GrossKind::Factor => "Simulation and recording differ by a factor",
        _ => "The recording is wrong",
    };
    format!("{wrong}: {}{other}; {}.", first.sentence, first.hint)
}
