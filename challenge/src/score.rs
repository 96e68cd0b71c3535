//! Opens the seal: compares answers with labels and goals, and fits that know the labels.

use std::{
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use stretch_blind::{COUNTED_EXCESS, CaseKind, Label, Score, Truth, Verdict};
use stretch_data::files::Outputs;
use stretch_gap::{Options, threads};

use crate::{
    goals::{Goal, goals},
    page::page,
    run::{diagnosed, shared_out},
    text::progress,
};

/// The answer in a case's folder.
pub const ANSWER: &str = "diagnosis.json";

/// What is scored.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answers {
    /// SHA-256 of the labels, as sealed.
    pub sha256: String,
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

/// Scores the answers of a folder, writes `score.json` and `report.html` into it, and returns the
/// score as text.
///
/// `with_oracle` fits every counted single effect with a catalogue of only that effect: what it
/// closes is the upper limit.
///
/// # Errors
/// A broken seal, invalid answers, a file that cannot be written, Ctrl-C.
pub fn score_answers(folder: &Path, with_oracle: bool) -> anyhow::Result<String> {
    let mut answers = Answers::read(folder)?;
    if with_oracle {
        oracle(folder, &mut answers)?;
    }
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
    let mut text = format!("seal intact, SHA-256 {sha256}\n\n");
    text.push_str("| goal | asked | reached | count | 95 % interval | met |\n");
    text.push_str("| --- | --- | --- | --- | --- | --- |\n");
    for goal in goals {
        // a string takes every write
        let _ = writeln!(text, "| {} |", goal.cells().join(" | "));
    }
    text + "too few: a single case decides.\n\n" + &score.to_string()
}

/// Adds to every counted single effect what a fit closes whose catalogue holds only the true
/// effect.
fn oracle(folder: &Path, answers: &mut Answers) -> anyhow::Result<()> {
    let is_counted =
        |label: &&Label| label.kind == CaseKind::Single && label.excess >= COUNTED_EXCESS;
    let label = |case: &String| answers.truth.cases.get(case).filter(is_counted);
    let verdicts = answers.verdicts.iter().enumerate();
    let wanted: Vec<(usize, &Label)> =
        verdicts.filter_map(|(i, v)| Some((i, label(&v.case)?))).collect();
    let progress = progress("fits that know the label", wanted.len());
    let found = shared_out(threads(0), wanted.len(), |at| {
        let (i, label) = wanted[at];
        let closed = closed_by(&folder.join(&answers.verdicts[i].case), &label.effects);
        progress.inc(1);
        Ok((i, closed))
    })?;
    for (i, closed) in found {
        answers.verdicts[i].closed_oracle = closed;
    }
    Ok(())
}

/// The share of the gap that these effects close if the catalogue has no other.
fn closed_by(case: &Path, effects: &[String]) -> Option<f64> {
    let names = stretch_sim::CATALOGUE.iter().map(|e| e.name);
    let without: Vec<&str> = names.filter(|name| effects.iter().all(|e| e != name)).collect();
    let options = Options { threads: 1, ..Options::default() };
    let (diagnosis, _) = diagnosed(case, &without, &options, &|_| ()).ok()?;
    diagnosis.candidates.first().map(|c| c.closed)
}
