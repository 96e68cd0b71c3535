//! What a problem is made of, entry by entry, as a user writes it down; [`Checked::new`](crate::Checked::new) checks it.
//!
//! Python hands these entries over by serde: the names of the fields are those of its package.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, de::Error};
use stretch_data::SessionTrial;
use stretch_effects::Kind;
use stretch_sim::Tolerance;

/// A problem with its recordings in memory.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ProblemSpec {
    /// Stages; one is enough.
    pub stages: Vec<Stage>,
    /// Columns that drive stages, where more is known of them than their name.
    pub inputs: Vec<Input>,
    /// Nominal parameters.
    pub parameters: Vec<Parameter>,
    /// Effects that the user's simulator has itself.
    pub effects: Vec<OwnEffect>,
    /// Wrappers to look for, as `input.delay`, `output.backlash`, `stage.output.lag`, or `all`.
    pub wrap: Vec<String>,
    /// Kinds of effects of the user's own, which `wrap` may name beside those of the catalogue.
    #[serde(skip)]
    pub kinds: Vec<&'static Kind>,
    /// Wrappers that act in every run, with their values: what was found before. They are not looked for.
    pub wrapped: Vec<Wrapped>,
    /// Effects that are not looked for, by name; a wrapper also by its kind or its place.
    pub without: Vec<String>,
    /// Further columns that a wrapper may take: what may talk across to a channel.
    pub beside: Vec<String>,
    /// The stage that is a sensor, by the column of its output, and the column that it measures, where there is such a stage: what a
    /// calibration of the sensor loses by the gap is told then, and slices go by that column.
    pub sensor: Option<Sensor>,
    /// Recordings.
    #[serde(skip)]
    pub trials: Vec<SessionTrial>,
}

impl ProblemSpec {
    /// Takes columns as those of a sensor, where some are given.
    pub(crate) fn set_sensor(&mut self, columns: Option<(&str, &str)>) {
        if let Some((reference, signal)) = columns {
            let (reference, signal) = (reference.to_owned(), signal.to_owned());
            self.sensor = Some(Sensor { reference, signal });
        }
    }
}

/// A stage that is a sensor.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Sensor {
    /// Column of what it measures.
    pub reference: String,
    /// Column of what it says: the output of a stage.
    pub signal: String,
}

/// A wrapper that acts in every run.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wrapped {
    /// Place and kind, as `output.backlash`.
    pub name: String,
    /// Its values by name; forms that are left out are usual.
    pub values: BTreeMap<String, f64>,
}

/// A stage: it turns measured input columns into one measured output column.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Stage {
    /// Name in reports.
    pub name: String,
    /// Column that its output is held against.
    pub output: String,
    /// Unit of the output; the last part of the column's name where it is empty.
    pub unit: String,
    /// Columns that it is driven by.
    pub inputs: Vec<String>,
    /// Noise of the output, one standard deviation; taken from the record where it is not known.
    pub noise: Option<f64>,
    /// Column of the velocity at which it rubs, for friction.
    pub velocity: Option<String>,
    /// Column of the position whose change is that velocity.
    pub position: Option<String>,
}

/// What is known of a column that drives a stage.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Input {
    /// The column.
    pub column: String,
    /// Its unit; the last part of the column's name where it is empty.
    pub unit: String,
    /// Its noise, one standard deviation; 0 for a command.
    pub noise: f64,
}

/// A nominal parameter.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Parameter {
    /// Name in reports.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value that the simulator ships with.
    pub value: f64,
    /// How far it may be off; to serde a number in its unit, or a text, `"10 %"`.
    #[serde(deserialize_with = "tolerance")]
    pub tolerance: Tolerance,
    /// Least value that makes sense.
    pub least: Option<f64>,
    /// Greatest value that makes sense.
    pub greatest: Option<f64>,
    /// Stages that it acts in; all where there is none.
    pub stages: Vec<String>,
}

/// An effect that the user's simulator has itself: arguments with values at which they do nothing.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OwnEffect {
    /// Name in reports.
    pub name: String,
    /// Its arguments.
    pub arguments: Vec<Argument>,
    /// Stages that it acts in; all where there is none.
    pub stages: Vec<String>,
    /// Names of effects that are hard to tell from it.
    pub twins: Vec<String>,
}

impl OwnEffect {
    /// Whether it acts in every run, with values that were found before.
    pub(crate) fn is_standing(&self) -> bool {
        self.arguments.iter().any(|a| a.value.is_some())
    }

    /// What a simulator knows the value of an argument by: the effect's name, and with several arguments `effect.argument`.
    pub(crate) fn value_name(&self, argument: &Argument) -> String {
        match self.arguments.len() {
            1 => self.name.clone(),
            _ => format!("{}.{}", self.name, argument.name),
        }
    }
}

/// An argument of an own effect.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Argument {
    /// Name; that of the effect where it is empty.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Least plausible value.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// Value at which it does nothing; none for a shape, which is then passed as the middle of its range where the effect is off.
    pub off: Option<f64>,
    /// Whether it is searched in equal ratios.
    #[serde(rename = "log")]
    pub is_log: bool,
    /// Value that it has in every run, where it was found before: the effect is not looked for then.
    pub value: Option<f64>,
}

/// What a tolerance is written as.
#[derive(Deserialize)]
#[serde(untagged)]
enum Told {
    Absolute(f64),
    Share(String),
}

fn tolerance<'de, D: Deserializer<'de>>(from: D) -> Result<Tolerance, D::Error> {
    match Option::<Told>::deserialize(from)? {
        None => Ok(Tolerance::Exact),
        Some(Told::Absolute(sd)) => Ok(Tolerance::Absolute(sd)),
        Some(Told::Share(text)) => share(&text).map(Tolerance::Relative).ok_or_else(|| {
            D::Error::custom(format!(
                "{text:?} is no share; write \"10 %\", or a number in its unit"
            ))
        }),
    }
}

/// The share that a text with a per cent sign says.
pub(crate) fn share(text: &str) -> Option<f64> {
    let percent = text.strip_suffix('%')?.trim().parse::<f64>().ok()?;
    percent.is_finite().then_some(percent / 100.0)
}
