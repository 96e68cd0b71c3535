//! The cases of a check and their answers, as stored in its folder.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use stretch_blind::{Seal, Truth, Verdict};

/// The answer in a case's folder.
pub const ANSWER: &str = "diagnosis.json";

/// What is scored.
#[derive(Debug, Clone, PartialEq)]
pub struct Answers {
    /// The seal of the labels, unbroken.
    pub seal: Seal,
    /// The labels.
    pub truth: Truth,
    /// What was answered; a case that was refused has none.
    pub verdicts: Vec<Verdict>,
}

impl Answers {
    /// Opens the labels and reads the answers.
    ///
    /// # Errors
    /// A broken seal, a folder without a case, an invalid answer.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let (seal, truth) = Seal::open(folder)?;
        let mut verdicts = Vec::new();
        for (name, path) in case_folders(folder)? {
            let file = path.join(ANSWER);
            if let Ok(text) = fs::read_to_string(&file) {
                let raw: serde_json::Value =
                    serde_json::from_str(&text).with_context(|| file.display().to_string())?;
                verdicts.push(Verdict::from_diagnosis(&name, &raw)?);
            }
        }
        Ok(Self { seal, truth, verdicts })
    }
}

/// Names and folders of the cases, in order.
///
/// # Errors
/// A folder that cannot be read or holds no case.
pub fn case_folders(folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut cases = Vec::new();
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        if path.join("dataset.toml").is_file() {
            cases.push((name, path));
        }
    }
    ensure!(!cases.is_empty(), "{}: there is no case in it", folder.display());
    cases.sort();
    Ok(cases)
}
