//! A problem as a user writes it down, in a `problem.toml` or in memory; [`Checked::new`](crate::Checked::new) checks the entries.
//!
//! Comments on fields are the descriptions of the keys in the reference of `problem.toml` and in its JSON Schema.

use std::{fmt, num::NonZeroUsize, path::PathBuf};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{Error, Unexpected, Visitor},
};
use stretch_data::{EffectEntry, SessionTrial, Split, from_zero};
use stretch_effects::Kind;
use stretch_recording::TimeUnit;
use stretch_sim::Tolerance;

use crate::card::Card;
use crate::file::{SimulatorEntry, simulator, simulator_schema};

/// A problem: what a `problem.toml` holds, and the recordings in memory.
///
/// ```
/// use stretch_problem::ProblemSpec;
/// let text = r#"
/// simulator = ["python3", "servo.py"]
/// wrap = ["input.delay", "output.backlash"]
/// [[stage]]
/// name = "servo"
/// output = "angle_deg"
/// inputs = ["command_V"]
/// [[parameter]]
/// name = "gain"
/// value = 10
/// tolerance = "10 %"
/// [[trial]]
/// file = "monday.csv"
/// "#;
/// let problem = ProblemSpec::parse("problem.toml", text)?;
/// assert_eq!(problem.parameters[0].name, "gain");
/// let error = ProblemSpec::parse("problem.toml", &text.replace("tolerance", "tolerence")).unwrap_err();
/// assert!(error.to_string().starts_with(
///     "problem.toml, row 11, key parameter[0].tolerence: unknown (did you mean tolerance?)"
/// ));
/// # Ok::<(), stretch_problem::ProblemError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "problem.toml of stretch", description = "Top-level keys of the file.", extend("required" = ["simulator"]))]
pub struct ProblemSpec {
    /// Name of the problem in reports.
    pub name: Option<String>,
    /// Folder to which file names are relative, if it is not the folder of the problem file.
    #[serde(default, skip_serializing_if = "is_default")]
    pub folder: PathBuf,
    /// The simulator: a command as a list, or the table `[simulator]`.
    #[serde(default, deserialize_with = "simulator")]
    #[schemars(schema_with = "simulator_schema")]
    pub simulator: Option<SimulatorEntry>,
    /// Effects to try around the stages: `all`, or names such as `input.delay`, `output.all`, `state.all`, `gear.output.backlash`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wrap: Vec<String>,
    /// Effects that are excluded from the search, by name, kind (`backlash`) or place (`output.all`).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Further columns that a wrapper may use: channels with possible crosstalk to another channel, loads of a contact.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<String>,
    /// Column that a sensor measures, if the output `signal` is the signal of this sensor. The diagnosis then reports how much the gap degrades
    /// a calibration of the sensor, and evaluates the gap by levels of this column.
    pub reference: Option<String>,
    /// Output of a stage that is a sensor; requires `reference`.
    pub signal: Option<String>,
    /// Time column; default `time_s`.
    pub time: Option<String>,
    /// Unit of the time, if the name of its column does not state it.
    pub time_unit: Option<TimeUnit>,
    /// Greatest number of runs of the simulator.
    pub budget: Option<NonZeroUsize>,
    /// The stages; required unless the simulator is built in.
    #[serde(rename = "stage", default, skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<StageEntry>,
    /// Unit and noise of input columns of stages, if they are known.
    #[serde(rename = "input", default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<Input>,
    /// Nominal parameters.
    #[serde(rename = "parameter", default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<Parameter>,
    /// Effects that the simulator implements.
    #[serde(rename = "effect", default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<OwnEffect>,
    /// Wrappers that act in every run, by place and kind (`output.backlash`), with their values; a form that is omitted has its default value.
    /// The diagnosis does not search for these wrappers. `--fix` writes them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wrapped: Vec<EffectEntry>,
    /// The recordings; required unless the simulator is built in, or only `stretch plan` and `stretch rehearse` read the file.
    #[serde(rename = "trial", default, skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<TrialFile>,
    /// What was fitted and how well; `--fix` writes it, and `stretch predict` reads it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub card: Option<Card>,
    /// Limits of the recordings that `stretch plan` proposes.
    pub plan: Option<PlanEntry>,
    /// Kinds of effects of the user's own, which `wrap` may name in addition to the kinds of the catalogue.
    #[serde(skip)]
    pub kinds: Vec<&'static Kind>,
    /// A column that distinguishes runs; no effect uses it.
    #[serde(skip)]
    pub by: Option<String>,
    /// Recordings in memory; [`ProblemSpec::load`] reads these.
    #[serde(skip)]
    pub trials: Vec<SessionTrial>,
}

/// Note for a simulator that takes no altered inputs, for which fewer effects are looked for.
pub(crate) const ONLY_BEHIND: &str = "no effect was looked for in front of a stage, because the simulator takes no altered inputs \
    (inputs = false in a worker's hello)";

impl ProblemSpec {
    /// The problem for a simulator that can run only on the recorded inputs: `all` becomes
    /// `output.all`, and the noise of inputs becomes 0. `None` if the problem contains neither.
    pub fn only_behind(&self) -> Option<Self> {
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

/// A stage maps measured input columns to one measured output column.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StageEntry {
    /// Name in reports; default: the output.
    #[serde(default)]
    pub name: String,
    /// Column that the simulated output is compared with.
    pub output: String,
    /// Unit of the output; default: the last part of the column's name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Columns that drive the stage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<String>,
    /// Noise of the output, one standard deviation; default: estimated from the recordings.
    #[serde(default, deserialize_with = "from_zero")]
    pub noise: Option<f64>,
    /// Column of the velocity at which the parts with friction move; friction effects need it, or `position`.
    /// Without both, the output is used if a force or a torque drives the stage and the output is a speed, a position or an angle.
    pub velocity: Option<String>,
    /// Column of the position from which that velocity is computed.
    pub position: Option<String>,
}

/// Unit and noise of an input column of a stage.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The column.
    pub column: String,
    /// Its unit; default: the last part of the column's name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Its noise, one standard deviation; 0 for a command; default 0.
    #[serde(default, deserialize_with = "from_zero")]
    pub noise: f64,
}

/// A nominal parameter, which may be re-tuned within three tolerances.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Name in the simulator.
    pub name: String,
    /// Unit; empty if there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Nominal value in the simulator.
    pub value: f64,
    /// One standard deviation: a number in the unit of the value, or a share such as `"10 %"`. By default, the value is
    /// exact.
    #[serde(default, with = "tolerance", skip_serializing_if = "is_default")]
    #[schemars(schema_with = "tolerance::schema")]
    pub tolerance: Tolerance,
    /// Smallest plausible value. By default, the value keeps its sign if its tolerance is relative or smaller than the
    /// value.
    pub least: Option<f64>,
    /// Greatest plausible value.
    pub greatest: Option<f64>,
    /// Names of the stages in which it acts; default: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stages: Vec<String>,
    /// Value re-tuned without the effects of the file; `stretch predict` uses it for comparison; `--fix` writes it.
    pub alone: Option<f64>,
}

/// An effect that the simulator implements. If it has one argument, the keys of the argument are given here; if it has several, each has a
/// table `[[effect.argument]]` with these keys.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "WrittenEffect", into = "WrittenEffect")]
pub struct OwnEffect {
    /// Name in reports.
    pub name: String,
    /// Its arguments.
    pub arguments: Vec<Argument>,
    /// Stages that the effect acts in; all stages if none is named.
    pub stages: Vec<String>,
    /// Names of effects that are hard to distinguish from it.
    pub twins: Vec<String>,
}

/// An [`OwnEffect`] as it is written.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct WrittenEffect {
    /// Name in the simulator.
    name: String,
    /// Names of the stages in which it acts; default: all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    stages: Vec<String>,
    /// Effects that are hard to distinguish from it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    twins: Vec<String>,
    /// Unit; empty if there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    unit: String,
    /// Smallest and largest plausible value; required if there is no `[[effect.argument]]`.
    #[serde(default, deserialize_with = "range")]
    range: Option<[f64; 2]>,
    /// Value at which it does nothing; omitted for a shape parameter.
    off: Option<f64>,
    /// Whether it is searched on a logarithmic scale.
    #[serde(default, skip_serializing_if = "is_default")]
    log: bool,
    /// Fixed value for every run, if it was found before; `--fix` writes it.
    value: Option<f64>,
    /// Its arguments, if it has several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    argument: Vec<Argument>,
}

impl TryFrom<WrittenEffect> for OwnEffect {
    type Error = String;

    fn try_from(written: WrittenEffect) -> Result<Self, String> {
        let WrittenEffect { name, stages, twins, unit, range, off, log: is_log, value, argument } =
            written;
        let has_own = range.is_some() || off.is_some() || value.is_some() || is_log;
        let arguments = match (argument.is_empty(), range) {
            (false, _) if has_own => {
                return Err("range, off, log and value belong in its [[effect.argument]]".into());
            }
            (false, _) => argument,
            (true, Some(range)) => {
                vec![Argument { name: String::new(), unit, range, off, is_log, value }]
            }
            (true, None) => return Err("it has no range; write range = [least, greatest]".into()),
        };
        match arguments.iter().find(|a| a.is_log && a.range[0] <= 0.0) {
            Some(a) => Err(format!(
                "its range begins at {}; on a logarithmic scale (log) it must begin above 0",
                a.range[0]
            )),
            None => Ok(Self { name, arguments, stages, twins }),
        }
    }
}

impl From<OwnEffect> for WrittenEffect {
    fn from(effect: OwnEffect) -> Self {
        let OwnEffect { name, mut arguments, stages, twins } = effect;
        let is_one = matches!(&arguments[..], [one] if one.name.is_empty());
        let one = if is_one { arguments.pop() } else { None };
        let range = one.as_ref().map(|one| one.range);
        let Argument { unit, off, is_log: log, value, .. } = one.unwrap_or_default();
        Self { name, stages, twins, unit, range, off, log, value, argument: arguments }
    }
}

impl OwnEffect {
    /// Whether the effect acts in every run, with values that were found before.
    pub(crate) fn is_standing(&self) -> bool {
        self.arguments.iter().any(|a| a.value.is_some())
    }

    /// Name of an argument's value for the simulator: the effect's name, or `effect.argument` if the effect has several
    /// arguments.
    pub(crate) fn value_name(&self, argument: &Argument) -> String {
        match self.arguments.len() {
            1 => self.name.clone(),
            _ => format!("{}.{}", self.name, argument.name),
        }
    }
}

/// One of several arguments of an effect; its name in the simulator is `effect.argument`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Argument {
    /// Name of the argument.
    pub name: String,
    /// Unit; empty if there is none.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Smallest and largest plausible value.
    #[serde(deserialize_with = "range")]
    pub range: [f64; 2],
    /// Value at which it does nothing; omitted for a shape parameter, which has the middle of its range while the effect is off.
    pub off: Option<f64>,
    /// Whether it is searched on a logarithmic scale.
    #[serde(rename = "log", default, skip_serializing_if = "is_default")]
    pub is_log: bool,
    /// Fixed value for every run, if it was found before; `--fix` writes it.
    pub value: Option<f64>,
}

/// A recording.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrialFile {
    /// File, relative to the problem's folder.
    pub file: String,
    /// Session time of its first sample, s; default: the trial follows the previous one.
    #[serde(default, skip_serializing_if = "is_default")]
    pub start_s: f64,
    /// `fit`, the default: for fitting; `test`: used only once, for the test at the end.
    #[serde(default, skip_serializing_if = "is_default")]
    pub split: Split,
}

/// Limits within which `stretch plan` chooses the next recordings. It needs the noise of every stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanEntry {
    /// Length of one recording, s; a diagnosis of a single recording needs 20 s.
    pub seconds: f64,
    /// Sample rate of the recordings, Hz.
    pub sample_rate_hz: f64,
    /// Greatest number of recordings; default 2.
    pub runs: Option<NonZeroUsize>,
    /// Limits of each input that is not the output of a stage. Every input moves in every recording.
    #[serde(rename = "input", default)]
    pub inputs: Vec<PlanInput>,
}

/// Limits of an input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanInput {
    /// The column.
    pub column: String,
    /// Smallest value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Greatest rate of change, per second.
    pub fastest: f64,
    /// Value at the beginning; default: 0, or the limit next to 0.
    pub rest: Option<f64>,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Reads a least and a greatest value.
fn range<'de, D, T>(from: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: From<[f64; 2]>,
{
    match Vec::<f64>::deserialize(from)?[..] {
        [least, greatest] if least < greatest => Ok(T::from([least, greatest])),
        [least, greatest] => Err(D::Error::custom(format!(
            "the range {least} to {greatest} is empty; give the least value first"
        ))),
        _ => Err(D::Error::custom("this is not a range; write [least, greatest]")),
    }
}

/// A tolerance as it is written: a number in the unit of the value, or a text such as `"10 %"`.
mod tolerance {
    use super::*;

    struct Written;

    impl Visitor<'_> for Written {
        type Value = Tolerance;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a tolerance; write \"10 %\", or a number in its unit")
        }

        fn visit_f64<E: Error>(self, sd: f64) -> Result<Tolerance, E> {
            Ok(Tolerance::Absolute(sd))
        }

        fn visit_i64<E: Error>(self, sd: i64) -> Result<Tolerance, E> {
            Ok(Tolerance::Absolute(sd as f64))
        }

        fn visit_u64<E: Error>(self, sd: u64) -> Result<Tolerance, E> {
            Ok(Tolerance::Absolute(sd as f64))
        }

        fn visit_str<E: Error>(self, text: &str) -> Result<Tolerance, E> {
            let percent = text.strip_suffix('%').and_then(|number| number.trim().parse().ok());
            match percent.filter(|percent: &f64| percent.is_finite()) {
                Some(percent) => Ok(Tolerance::Relative(percent / 100.0)),
                None => Err(E::invalid_value(Unexpected::Str(text), &self)),
            }
        }

        fn visit_unit<E: Error>(self) -> Result<Tolerance, E> {
            Ok(Tolerance::Exact)
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Tolerance, D::Error> {
        match from.deserialize_any(Written)? {
            Tolerance::Absolute(x) | Tolerance::Relative(x) if x < 0.0 => {
                Err(D::Error::custom("it is below 0; give one standard deviation"))
            }
            tolerance => Ok(tolerance),
        }
    }

    pub(super) fn serialize<S: Serializer>(
        tolerance: &Tolerance,
        to: S,
    ) -> Result<S::Ok, S::Error> {
        match tolerance {
            Tolerance::Exact => to.serialize_none(),
            Tolerance::Absolute(sd) => to.serialize_f64(*sd),
            Tolerance::Relative(share) => to.collect_str(&format_args!("{} %", 100.0 * share)),
        }
    }

    pub(super) fn schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "oneOf": [{ "type": "number", "minimum": 0 }, { "type": "string", "pattern": "%$" }] })
    }
}
