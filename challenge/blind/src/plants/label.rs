//! Labels of an open set: what is missing in each case, and the names that an answer may use.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::family::Form;
use crate::{error::BlindError, seal, words::worded};

worded! {
    /// How hard a case is.
    Level {
        /// One effect, at least 3 times the noise's variance.
        Strong "strong",
        /// One effect, 0.1 to 1 times the noise's variance.
        Faint "faint",
        /// Two strong effects.
        Two "two",
        /// No effect: parameters within their tolerances at most.
        Nothing "none",
        /// One strong effect that is not among the candidates.
        Foreign "foreign",
    }
}

/// The truth of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenLabel {
    /// How hard it is.
    pub level: Level,
    /// Effects at work.
    pub effects: Vec<String>,
    /// Stage of each.
    pub places: Vec<String>,
    /// Reduced chi-square minus one of the re-tuned nominal simulator, to first order.
    pub excess: f64,
    /// Share of it that the true effects with the true forms close on the test trials, noise
    /// included.
    pub oracle_closed: f64,
    /// Family of its forms and its noise.
    pub family: String,
    /// Strength of each effect.
    #[serde(default)]
    pub strengths: Vec<f64>,
    /// Form of each effect.
    #[serde(default)]
    pub forms: Vec<Form>,
    /// Nominal parameters of this one plant.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
}

/// The truth of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenTruth {
    /// Version of this file, 1.
    pub schema: u32,
    /// Plant.
    pub plant: String,
    /// Seed that the set was made from.
    pub seed: u64,
    /// Names that an answer may use, with their stage.
    pub candidates: BTreeMap<String, String>,
    /// Truth of each case.
    pub cases: BTreeMap<String, OpenLabel>,
}

/// Where the labels of a set are: in the folder `DIR-sealed` next to the set, which is kept back
/// when the set is given away.
#[must_use]
pub fn sealed_beside(set: &Path) -> PathBuf {
    let mut name = set.file_name().unwrap_or_default().to_os_string();
    name.push("-sealed");
    set.with_file_name(name)
}

impl OpenTruth {
    /// Writes the labels to `truth.json` of a folder; returns their SHA-256.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn seal(&self, folder: &Path) -> Result<String, BlindError> {
        seal::close(&folder.join("truth.json"), self)
    }

    /// Opens the labels of a set, if they match the hash in the set; also returns the hash.
    ///
    /// # Errors
    /// A broken seal, or a file that is missing or invalid.
    pub fn open(set: &Path) -> Result<(Self, String), BlindError> {
        seal::open(&sealed_beside(set).join("truth.json"), &set.join("seal.sha256"))
    }
}
