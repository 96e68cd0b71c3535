//! Labels of an open set: the missing effects of each case, the names that an answer may use, and
//! the families from which the forms of effects are drawn.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::{effect::worded, error::BlindError, random::RandomGenerator, seal};

/// Deviation of an effect from its textbook form, which has 0 for all three numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Form {
    /// Roundness of the corners, 0 to 1.
    pub softness: f64,
    /// Difference between the two directions, -0.5 to 0.5.
    pub asymmetry: f64,
    /// Spread of the internal scales, such as radii or time constants, 0 to 0.9.
    pub spread: f64,
}

/// Ranges in which the forms and the noise of a case are uniformly distributed.
///
/// ```
/// let names: Vec<String> = stretch_blind::FormFamily::published().into_iter().map(|f| f.name).collect();
/// assert_eq!(names, ["sharp", "soft", "skewed"]);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FormFamily {
    /// Name in labels.
    pub name: String,
    /// Range of [`Form::softness`].
    pub softness: (f64, f64),
    /// Range of [`Form::asymmetry`].
    pub asymmetry: (f64, f64),
    /// Range of [`Form::spread`].
    pub spread: (f64, f64),
    /// Range of the correlation of the noise from sample to sample, 0 to 0.9.
    pub colour: (f64, f64),
}

impl FormFamily {
    /// Returns the three published families.
    #[must_use]
    pub fn published() -> Vec<Self> {
        let family = |name: &str, softness, asymmetry, spread, colour| Self {
            name: name.to_owned(),
            softness,
            asymmetry,
            spread,
            colour,
        };
        vec![
            family("sharp", (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),
            family("soft", (0.1, 0.4), (0.0, 0.0), (0.1, 0.4), (0.0, 0.0)),
            family("skewed", (0.0, 0.2), (-0.3, 0.3), (0.2, 0.6), (0.0, 0.3)),
        ]
    }

    /// Reads a family from a JSON file with the same fields. The author of a set keeps this file
    /// private.
    ///
    /// # Errors
    /// A file that cannot be read, a field that is missing or out of its range.
    pub fn read(path: &Path) -> Result<Self, BlindError> {
        let text = fs::read_to_string(path).map_err(BlindError::io(path))?;
        let family: Self = serde_json::from_str(&text).map_err(BlindError::json(path))?;
        let ranges = [
            ("softness", family.softness, 0.0, 1.0),
            ("asymmetry", family.asymmetry, -0.5, 0.5),
            ("spread", family.spread, 0.0, 0.9),
            ("colour", family.colour, 0.0, 0.9),
        ];
        for (field, (low, high), least, most) in ranges {
            if !(least <= low && low <= high && high <= most) {
                let reason =
                    format!("{low} .. {high} is no range within {least} .. {most}: correct it");
                return Err(BlindError::field(field, reason));
            }
        }
        Ok(family)
    }

    pub(super) fn form(&self, random: &mut RandomGenerator) -> Form {
        let mut draw = |(low, high): (f64, f64)| random.between(low, high);
        Form {
            softness: draw(self.softness),
            asymmetry: draw(self.asymmetry),
            spread: draw(self.spread),
        }
    }
}

worded! {
    /// Difficulty of a case.
    Level {
        /// One effect with an excess of at least 3.
        Strong "strong",
        /// One effect with an excess of 0.1 to 1.
        Faint "faint",
        /// Two strong effects.
        Two "two",
        /// No effect; the parameters may differ from their nominal values within their tolerances.
        Nothing "none",
        /// One strong effect that is not among the candidates.
        Foreign "foreign",
    }
}

/// The truth of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenLabel {
    /// Difficulty of the case.
    pub level: Level,
    /// Active effects.
    pub effects: Vec<String>,
    /// Stage of each effect.
    pub places: Vec<String>,
    /// Reduced chi-square minus one of the re-tuned nominal simulator, to first order.
    pub excess: f64,
    /// Share of the excess that a simulator with the true effects in their true forms closes on the
    /// test trials, with noise.
    pub oracle_closed: f64,
    /// Family of the forms and the noise.
    pub family: String,
    /// Strength of each effect.
    #[serde(default)]
    pub strengths: Vec<f64>,
    /// Form of each effect.
    #[serde(default)]
    pub forms: Vec<Form>,
    /// True values of the nominal parameters in this case.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
}

/// All labels of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenTruth {
    /// Version of this file, 1.
    pub schema: u32,
    /// Plant.
    pub plant: String,
    /// Seed of the set.
    pub seed: u64,
    /// Names that an answer may use, each with its stage.
    pub candidates: BTreeMap<String, String>,
    /// Label of each case.
    pub cases: BTreeMap<String, OpenLabel>,
}

/// Returns the folder of the labels of a set: `DIR-sealed` next to the set. It is not published
/// with the set.
#[must_use]
pub fn sealed_beside(set: &Path) -> PathBuf {
    let mut name = set.file_name().unwrap_or_default().to_os_string();
    name.push("-sealed");
    set.with_file_name(name)
}

impl OpenTruth {
    /// Opens the labels of a set if they match the hash in the set. Also returns the hash.
    ///
    /// # Errors
    /// A broken seal, or a file that is missing or invalid.
    pub fn open(set: &Path) -> Result<(Self, String), BlindError> {
        seal::open(&sealed_beside(set).join("truth.json"), set)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_private_family_is_read_and_a_wrong_range_named() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("mine.json");
        let text = |spread: &str| {
            format!(
                r#"{{"name":"mine","softness":[0,0.5],"asymmetry":[0,0],"spread":{spread},"colour":[0,0]}}"#
            )
        };
        fs::write(&path, text("[0.1,0.2]")).expect("written");
        assert_eq!(FormFamily::read(&path).expect("a family").spread, (0.1, 0.2));
        fs::write(&path, text("[0.1,2]")).expect("written");
        let error = FormFamily::read(&path).expect_err("out of range").to_string();
        assert!(error.starts_with("spread: "), "{error}");
    }
}
