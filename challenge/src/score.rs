//! Opens the labels, and compares the answers with labels and goals.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use stretch_blind::{Score, Truth, Verdict};
use stretch_data::files::Outputs;

use crate::{
    goals::{Goal, goals},
    page::page,
    text::table,
};

/// File of the answer in the folder of a case.
pub const ANSWER: &str = "diagnosis.json";

/// The answers with their labels.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answers {
    /// SHA-256 of the labels.
    pub sha256: String,
    /// The labels.
    pub truth: Truth,
    /// Verdicts of all cases that have an answer.
    pub verdicts: Vec<Verdict>,
}

impl Answers {
    /// Opens the labels and reads the answers.
    ///
    /// # Errors
    /// A broken seal, a folder without a case, an invalid answer.
    pub(crate) fn read(folder: &Path) -> anyhow::Result<Self> {
        let (truth, sha256) = Truth::open(folder)?;
        let mut verdicts = Vec::new();
        for (name, path) in case_folders(folder)? {
            let file = path.join(ANSWER);
            if let Ok(text) = fs::read_to_string(&file) {
                let raw: serde_json::Value =
                    serde_json::from_str(&text).with_context(|| file.display().to_string())?;
                verdicts.push(Verdict::from_diagnosis(&name, &raw)?);
            }
        }
        Ok(Self { sha256, truth, verdicts })
    }
}

/// Names and folders of the cases, in order.
///
/// # Errors
/// A folder that cannot be read or holds no case.
pub(crate) fn case_folders(folder: &Path) -> anyhow::Result<Vec<(String, PathBuf)>> {
    let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let mut cases = Vec::new();
    for entry in entries {
        let entry = entry?;
        if entry.path().join("dataset.toml").is_file() {
            cases.push((entry.file_name().to_string_lossy().into_owned(), entry.path()));
        }
    }
    ensure!(!cases.is_empty(), "{}: there is no case in it", folder.display());
    cases.sort();
    Ok(cases)
}

/// Scores the answers of a folder, writes `score.json` and `report.html` into it, and returns a
/// table of the goals.
///
/// # Errors
/// A broken seal, invalid answers, a file that cannot be written.
pub fn score_answers(folder: &Path) -> anyhow::Result<String> {
    let answers = Answers::read(folder)?;
    let score = Score::of(&answers.truth, &answers.verdicts)?;
    let goals = goals(&score);
    let json = serde_json::json!({ "score": score, "goals": goals });
    let mut outputs = Outputs::default();
    for (file, text) in [
        ("report.html", page(&score, &answers, &goals)),
        ("score.json", serde_json::to_string_pretty(&json)? + "\n"),
    ] {
        outputs.file(folder.join(file), |out| out.write_all(text.as_bytes()))?;
    }
    outputs.keep()?;
    Ok(text(&score, &goals, &answers.sha256))
}

fn text(score: &Score, goals: &[Goal], sha256: &str) -> String {
    let head = ["goal", "asked", "reached", "count", "95 % interval", "met"];
    let goals = table(head, goals.iter().map(Goal::cells));
    format!(
        "seal intact, SHA-256 {sha256}\n\n{goals}\ntoo few: a single case decides.\n\n{} wrong of {}.",
        score.misses.len(),
        score.cases
    )
}
