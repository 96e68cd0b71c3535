//! Describes errors of the recording and of the rig file in words, with what a user should check.

use stretch_data::{after_number, in_digits};

use crate::{
    fit::hypothesis::Hypothesis,
    problem::{column::Column, record_facts::nouns, simulator::Simulator},
    record::{
        fault::Kind,
        gross::{Gross, GrossKind},
        suspect::Suspect,
        units::units,
    },
};

impl Gross {
    fn of(what: GrossKind) -> Self {
        Self {
            what,
            column: None,
            parameter: None,
            factor: None,
            offset: None,
            delay_s: None,
            says: None,
            found: None,
            unit: String::new(),
            units: None,
            trial: None,
            from_s: None,
            to_s: None,
            sentence: String::new(),
            hint: String::new(),
        }
    }

    fn of_column(what: GrossKind, column: &Column<'_>) -> Self {
        Self {
            column: Some(column.name.clone().into_owned()),
            unit: column.unit.clone().into_owned(),
            hint: format!("check {}", column.hint),
            ..Self::of(what)
        }
    }

    /// Creates the error that `column` is `factor` times `source`, including noise.
    pub(crate) fn copied(column: &Column<'_>, source: &Column<'_>, factor: f64) -> Self {
        Self {
            factor: Some(factor),
            sentence: format!(
                "{} is a copy of {} ({} times it, noise and all)",
                column.name,
                source.name,
                in_digits(factor, 4)
            ),
            hint: "check which channels the recorder wrote into the two columns".into(),
            ..Self::of_column(GrossKind::Copied, column)
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
        Self {
            sentence: format!(
                "{} is constant while the others move ({trial}, {from_s:.2} to {to_s:.2} s{more})",
                column.name
            ),
            trial: Some(trial.clone()),
            from_s: Some(*from_s),
            to_s: Some(*to_s),
            ..Self::of_column(GrossKind::Dead, column)
        }
    }

    /// Creates the error that simulator and recording of an output differ by a factor, because of
    /// other units, or because no parameter of the simulator may change (`is_exact`).
    fn of_factor(column: &Column<'_>, factor: f64, units: Option<String>, is_exact: bool) -> Self {
        let or = if is_exact { ", or give the parameters tolerances" } else { "" };
        let that_is = units.as_ref().map_or(String::new(), |units| format!(": that is {units}"));
        let ratio = in_digits(1.0 / factor, 4);
        Self {
            factor: Some(factor),
            sentence: format!(
                "the simulated {} is {ratio} times the recording's{that_is}",
                column.name
            ),
            hint: format!("simulate in the unit of the recording, or convert the recording{or}"),
            units,
            ..Self::of_column(GrossKind::Factor, column)
        }
    }

    /// Describes the error of the recording that a hypothesis assumes, with its size; `None` if it assumes none.
    pub(crate) fn found(suspect: &Suspect<'_>, hypothesis: &Hypothesis) -> Option<Self> {
        let (fault, size) = suspect.error_of(&hypothesis.model)?;
        if let Kind::Parameter(p) = fault.kind {
            let [simulator, rig] = nouns(suspect.description().record().gauge_alone);
            let spec = &suspect.description().parameters[p];
            let value = hypothesis.model.parameters[p] * (1.0 + size);
            let unit = after_number(&spec.unit);
            return Some(Self {
                parameter: Some(spec.name.clone()),
                factor: Some(value / spec.nominal),
                says: Some(spec.nominal),
                found: Some(value),
                unit: spec.unit.clone(),
                sentence: format!(
                    "{} is {}{unit} on the {rig}, and {} in the {simulator}",
                    spec.name,
                    in_digits(value, 4),
                    in_digits(spec.nominal, 4)
                ),
                hint: format!(
                    "correct the parameter of the {simulator}, or the setting of the {rig}"
                ),
                ..Self::of(GrossKind::Parameter)
            });
        }
        let column = &suspect.columns()[fault.column?];
        let name = &column.name;
        Some(match fault.kind {
            Kind::Scale => {
                let factor = fault.factor(size);
                let sd = hypothesis.effect_sd.values().flatten().fold(0.0, |a: f64, b| a.max(*b));
                let units = units(1.0 / factor, sd / (1.0 + size), &column.unit);
                let is_output = column.output_of.is_some();
                let units = units.filter(|_| is_output);
                let is_exact = suspect.description().parameters.iter().all(|p| p.sd == 0.0);
                if units.is_some() || fault.is_beyond() || is_exact && is_output {
                    return Some(Self::of_factor(column, factor, units, is_exact));
                }
                let sentence = match factor >= 1.0 {
                    true => format!("{name} looks {factor:.3} times too large"),
                    false => format!("{name} looks {factor:.3} times as large as it should be"),
                };
                Self { factor: Some(factor), sentence, ..Self::of_column(GrossKind::Scale, column) }
            }
            Kind::Offset => {
                let side = if size > 0.0 { "high" } else { "low" };
                Self {
                    offset: Some(size),
                    sentence: format!(
                        "{name} lies {}{} too {side}",
                        in_digits(size.abs(), 4),
                        after_number(&column.unit)
                    ),
                    ..Self::of_column(GrossKind::Offset, column)
                }
            }
            Kind::Delay => {
                let side = if size > 0.0 { "late" } else { "early" };
                Self {
                    delay_s: Some(size),
                    sentence: format!("{name} comes {:.3} s {side}", size.abs()),
                    hint: "check the clocks of the recorders, and filters before them".into(),
                    ..Self::of_column(GrossKind::Delay, column)
                }
            }
            _ => Self {
                factor: Some(-1.0),
                offset: Some(size),
                sentence: format!("{name} is upside down: it falls where it should rise"),
                hint: format!("check the polarity: {}", column.hint),
                ..Self::of_column(GrossKind::Sign, column)
            },
        })
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
