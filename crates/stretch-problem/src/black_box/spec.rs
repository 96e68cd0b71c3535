//! The entries of a problem as a user writes them down; [`Checked::new`](crate::Checked::new) checks the entries.
//!
//! Python hands these entries over by serde: the fields have the names that the Python package gives them.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, de::Error};
use stretch_data::SessionTrial;
use stretch_effects::Kind;
use stretch_sim::Tolerance;

/// A problem with its recordings in memory.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ProblemSpec {
    /// Stages, at least one.
    pub stages: Vec<StageEntry>,
    /// Unit and noise of columns that drive stages, where they are known.
    pub inputs: Vec<Input>,
    /// Nominal parameters.
    pub parameters: Vec<Parameter>,
    /// Effects that the user's simulator has itself.
    pub effects: Vec<OwnEffect>,
    /// Wrappers to look for, as `input.delay`, `output.backlash`, `stage.output.lag`, or `all`.
    pub wrap: Vec<String>,
    /// Kinds of effects of the user's own, which `wrap` may name beside the kinds of the catalogue.
    #[serde(skip)]
    pub kinds: Vec<&'static Kind>,
    /// Wrappers that were found before and act in every run, with their values. These wrappers are not looked for.
    pub wrapped: Vec<Wrapped>,
    /// Effects that are not looked for, by name; a wrapper is also named by its kind or its place.
    pub without: Vec<String>,
    /// Further columns that a wrapper may take: channels that may talk across to another channel.
    pub beside: Vec<String>,
    /// A column by which runs are told apart, which no effect looks at.
    #[serde(skip)]
    pub by: Option<String>,
    /// The stage that is a sensor, where there is one, by the column of its output and the column that it measures: the diagnosis then
    /// reports what a calibration of the sensor loses by the gap, and slices go by the measured column.
    pub sensor: Option<Sensor>,
    /// Recordings.
    #[serde(skip)]
    pub trials: Vec<SessionTrial>,
}

impl ProblemSpec {
    /// Takes columns as those of a sensor, where columns are given.
    pub(crate) fn set_sensor(&mut self, columns: Option<(&str, &str)>) {
        if let Some((reference, signal)) = columns {
            let (reference, signal) = (reference.to_owned(), signal.to_owned());
            self.sensor = Some(Sensor { reference, signal });
        }
    }
}

/// Says that the catalogue was narrowed for a simulator that takes no altered inputs.
pub(crate) const ONLY_BEHIND: &str = "nothing was looked for on the input's side: the simulator takes no altered inputs (inputs = false in a worker's hello)";

impl ProblemSpec {
    /// The problem for a simulator that cannot be driven by other inputs than the recorded ones: `all` stands for what can be behind the
    /// simulator, and noise of its inputs is not drawn. `None` where the problem asks for nothing else anyway.
    pub(crate) fn only_behind(&self) -> Option<Self> {
        let is_noisy = |input: &Input| input.noise > 0.0;
        if !self.wrap.iter().any(|name| name == "all") && !self.inputs.iter().any(is_noisy) {
            return None;
        }
        let mut spec = self.clone();
        for name in spec.wrap.iter_mut().filter(|name| *name == "all") {
            "output.all".clone_into(name);
        }
        spec.inputs.iter_mut().for_each(|input| input.noise = 0.0);
        Some(spec)
    }
}

/// A stage that is a sensor.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Sensor {
    /// Column that the sensor measures.
    pub reference: String,
    /// Column of its output: the output of a stage.
    pub signal: String,
}

/// A wrapper that acts in every run.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wrapped {
    /// Place and kind, as `output.backlash`.
    pub name: String,
    /// Its values by name; a form that is left out has its usual value.
    pub values: BTreeMap<String, f64>,
}

/// A stage, which turns measured input columns into one measured output column.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StageEntry {
    /// Name in reports.
    pub name: String,
    /// Column that the simulated output is compared with.
    pub output: String,
    /// Unit of the output; the last part of the column's name where it is empty.
    pub unit: String,
    /// Columns that drive the stage.
    pub inputs: Vec<String>,
    /// Noise of the output, one standard deviation; estimated from the recordings where it is not given.
    pub noise: Option<f64>,
    /// Column of the velocity of the rubbing parts, for friction.
    pub velocity: Option<String>,
    /// Column of the position whose change is that velocity.
    pub position: Option<String>,
}

/// Unit and noise of a column that drives a stage.
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
    /// Value that the simulator is shipped with.
    pub value: f64,
    /// Tolerance, one standard deviation; for serde a number in the unit, or a text such as `"10 %"`.
    #[serde(deserialize_with = "tolerance")]
    pub tolerance: Tolerance,
    /// Least value that makes sense.
    pub least: Option<f64>,
    /// Greatest value that makes sense.
    pub greatest: Option<f64>,
    /// Stages that the parameter acts in; all stages where none is named.
    pub stages: Vec<String>,
    /// Value re-tuned without the effects that were found, beside which a [foretelling](crate::foretell) is judged; a fix writes it.
    pub alone: Option<f64>,
}

/// An effect that the user's simulator has itself: arguments, with the values at which the effect does nothing.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OwnEffect {
    /// Name in reports.
    pub name: String,
    /// Its arguments.
    pub arguments: Vec<Argument>,
    /// Stages that the effect acts in; all stages where none is named.
    pub stages: Vec<String>,
    /// Names of effects that are hard to tell from it.
    pub twins: Vec<String>,
}

impl OwnEffect {
    /// Whether the effect acts in every run, with values that were found before.
    pub(crate) fn is_standing(&self) -> bool {
        self.arguments.iter().any(|a| a.value.is_some())
    }

    /// Name of an argument's value for the simulator: the effect's name, or `effect.argument` where the effect has several arguments.
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
    /// Name; the name of the effect where this one is empty.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Least plausible value.
    pub min: f64,
    /// Greatest plausible value.
    pub max: f64,
    /// Value at which the effect does nothing; none for a shape, which has the middle of its range where the effect is off.
    pub off: Option<f64>,
    /// Whether the value is searched in equal ratios.
    #[serde(rename = "log")]
    pub is_log: bool,
    /// Value in every run, where the value was found before; the effect is then not looked for.
    pub value: Option<f64>,
}

/// A tolerance as it is written.
#[derive(Deserialize)]
#[serde(untagged)]
enum WrittenTolerance {
    Absolute(f64),
    Share(String),
}

fn tolerance<'de, D: Deserializer<'de>>(from: D) -> Result<Tolerance, D::Error> {
    match Option::<WrittenTolerance>::deserialize(from)? {
        None => Ok(Tolerance::Exact),
        Some(WrittenTolerance::Absolute(sd)) => Ok(Tolerance::Absolute(sd)),
        Some(WrittenTolerance::Share(text)) => {
            share(&text).map(Tolerance::Relative).ok_or_else(|| {
                D::Error::custom(format!(
                    "{text:?} is no share; write \"10 %\", or a number in its unit"
                ))
            })
        }
    }
}

/// The share that a text with a per cent sign gives.
pub(crate) fn share(text: &str) -> Option<f64> {
    let percent = text.strip_suffix('%')?.trim().parse::<f64>().ok()?;
    percent.is_finite().then_some(percent / 100.0)
}
