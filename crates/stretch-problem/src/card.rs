//! The card of an actuator or a sensor: what a fix needs so that others can check it on their own
//! recordings, without those that were fitted.

use std::{
    collections::BTreeMap,
    fmt::Write,
    fs,
    path::{Path, PathBuf},
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use stretch_data::{ends, significant};
use stretch_gap::Diagnosis;

use crate::{
    black_box::{Checked, velocity::of_position},
    fix::COVERS,
};

/// Number of significant digits of a card's values.
const DIGITS: usize = 4;

/// What was fitted, how well it predicts motions that were not fitted, and in which range; `--fix`
/// writes it. With it, `stretch predict` checks the file on other recordings without the fitted ones.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Card {
    /// Version of the program that wrote the card.
    pub version: String,
    /// Result of the diagnosis.
    pub sentence: String,
    /// 95 % interval of each fitted value, by parameter or `effect.parameter`.
    #[serde(default)]
    pub intervals: BTreeMap<String, [f64; 2]>,
    /// The recordings.
    #[serde(rename = "recording", default, skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<CardRecording>,
    /// Errors of the outputs on motions that were not fitted.
    #[serde(rename = "output", default, skip_serializing_if = "Vec::is_empty")]
    pub outputs: Vec<CardOutput>,
    /// Fitted ranges of the columns.
    #[serde(rename = "column", default, skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<CardColumn>,
}

/// A recording of a card.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CardRecording {
    /// File.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
}

/// Error of an output on the motions that were not fitted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CardOutput {
    /// Column of the output.
    pub column: String,
    /// Root mean square error, in the unit of the output.
    pub rmse: f64,
    /// The same in multiples of the noise.
    pub times_noise: f64,
}

/// Range of a column in the recordings that were fitted.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CardColumn {
    /// The column.
    pub name: String,
    /// Least and greatest value.
    pub values: [f64; 2],
    /// Least and greatest rate, per second.
    pub rates: [f64; 2],
}

impl Card {
    /// The card of a fix with these effects.
    pub(crate) fn of(problem: &Checked, diagnosis: &Diagnosis, effects: &[String]) -> Self {
        let round = |x: f64| significant(x, DIGITS);
        let shifts = diagnosis.parameters.iter();
        let parameters =
            shifts.map(|p| (p.name.clone(), [-COVERS, COVERS].map(|k| round(p.fitted + k * p.sd))));
        let values = diagnosis.candidates.iter().take(1).flat_map(|c| &c.parameters);
        let values = values
            .filter(|value| effects.contains(&value.effect))
            .map(|value| (format!("{}.{}", value.effect, value.name), value.interval.map(round)));
        let spec = problem.spec();
        let recording = |file: &String| {
            let sha256 = digest(&spec.folder.join(file))?;
            Some(CardRecording { file: file.clone(), sha256 })
        };
        let stages = diagnosis.location.stages.iter().filter(|stage| !stage.is_cause_only);
        let outputs = stages.map(|stage| {
            let excess = if effects.is_empty() { stage.excess } else { stage.after };
            let times_noise = (1.0 + excess).max(0.0).sqrt();
            CardOutput {
                column: stage.channel.clone(),
                rmse: round(times_noise * stage.floor),
                times_noise: round(times_noise),
            }
        });
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            sentence: diagnosis.sentence.clone(),
            intervals: parameters.chain(values).collect(),
            recordings: spec.files.iter().filter_map(|entry| recording(&entry.file)).collect(),
            outputs: outputs.collect(),
            columns: CardColumn::all(problem),
        }
    }

    /// Names of new files that are among the recordings of the card.
    pub(crate) fn known<'a>(&self, new: &'a [PathBuf]) -> Vec<&'a Path> {
        let is_known = |path: &&PathBuf| {
            let found = digest(path);
            self.recordings.iter().any(|own| Some(&own.sha256) == found.as_ref())
        };
        new.iter().filter(is_known).map(PathBuf::as_path).collect()
    }
}

impl CardColumn {
    /// The fitted ranges of all inputs and outputs of a problem, by name.
    pub(crate) fn all(problem: &Checked) -> Vec<Self> {
        let (columns, stages) = (&problem.columns, &problem.session().stages);
        let fitted = columns.looked_at();
        let mut names: Vec<&String> =
            stages.iter().flat_map(|s| s.inputs.iter().chain([&s.output])).collect();
        names.sort_unstable();
        names.dedup();
        let of = |name: &String| {
            let values = columns.all(name);
            let rates = of_position(values, &columns.ranges, problem.session().dt_s);
            let range = |all: &[f64]| {
                let (low, high) = ends(fitted.iter().flat_map(|range| &all[range.clone()]));
                [low, high]
            };
            Self { name: name.clone(), values: range(values), rates: range(&rates) }
        };
        names.into_iter().map(of).collect()
    }
}

/// SHA-256 of a file; `None` if it cannot be read.
fn digest(path: &Path) -> Option<String> {
    let bytes = fs::read(path).ok()?;
    let write = |mut text: String, byte: &u8| {
        // Writing to a String does not fail.
        let _ = write!(text, "{byte:02x}");
        text
    };
    Some(Sha256::digest(bytes).iter().fold(String::new(), write))
}
