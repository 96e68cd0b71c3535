//! The cases of a blind check and their answers, as they lie in its folder.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use stretch_blind::{Seal, Truth, Verdict};

/// The answer in a case's folder.
pub(super) const ANSWER: &str = "diagnosis.json";

/// What is scored.
pub(super) struct Answers {
    pub(super) seal: Seal,
    pub(super) truth: Truth,
    pub(super) verdicts: Vec<Verdict>,
}

/// Folders of the cases, in order.
pub(super) fn cases(folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
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

/// The answers, with the labels' seal unbroken, and the refusals by case.
pub(super) fn answers(folder: &Path) -> anyhow::Result<Answers> {
    let (seal, truth) = Seal::open(folder)?;
    let mut answers = Answers { seal, truth, verdicts: Vec::new() };
    for (name, path) in cases(folder)? {
        let file = path.join(ANSWER);
        if let Ok(text) = fs::read_to_string(&file) {
            let raw: serde_json::Value =
                serde_json::from_str(&text).with_context(|| file.display().to_string())?;
            answers.verdicts.push(Verdict::from_diagnosis(&name, &raw)?);
        }
    }
    Ok(answers)
}
