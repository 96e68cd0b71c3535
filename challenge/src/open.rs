//! Sets that strangers solve: making them, scoring submissions, and recording their seeds.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use stretch_blind::{
    Figures, FormFamily, Interval, OpenScore, OpenTruth, PlantName, Submission, make_set_apart,
    sealed_beside,
};
use stretch_data::files::{write_folder, write_whole};

/// Makes a set of cases of a plant, completely or not at all; refuses a spent seed.
///
/// # Errors
/// A spent seed, a folder that is not empty, a private family that cannot be read.
pub fn make_open(
    plant: PlantName,
    set: &Path,
    (cases, seed): (usize, u64),
    private: Option<&Path>,
    spent: &Path,
) -> anyhow::Result<String> {
    let is_spent = spent_seeds(spent)?.iter().any(|(p, s)| p == plant.name() && *s == seed);
    ensure!(
        !is_spent,
        "--seed {seed}: {} says that {} cases of it have been opened; take another",
        spent.display(),
        plant.name()
    );
    let private = private.map(FormFamily::read).transpose()?;
    let (sealed, mut hash) = (sealed_beside(set), None);
    let made = write_folder(set, false, |cases_draft| {
        write_folder(&sealed, false, |labels_draft| {
            let folders = (cases_draft, labels_draft);
            hash = Some(make_set_apart(plant, folders, cases, seed, private)?);
            anyhow::Ok(())
        })
    });
    if made.is_err() && hash.is_some() {
        // labels have their name, their cases do not
        let _ = fs::remove_dir_all(&sealed);
    }
    made?;
    hash.context("no set was made")
}

/// Scores a submission against the set next to whose labels it was made, writes
/// `SUBMISSION.score.json`, and records the seed. `first` limits the set and the submission to that
/// many of the first cases.
///
/// # Errors
/// A submission that cannot be read or uses names that the set does not have, a broken seal.
pub fn score_open(
    submission: &Path,
    set: &Path,
    spent: &Path,
    first: Option<usize>,
) -> anyhow::Result<String> {
    let text = fs::read_to_string(submission).with_context(|| submission.display().to_string())?;
    let mut read: Submission =
        serde_json::from_str(&text).with_context(|| submission.display().to_string())?;
    let (mut truth, hash) = OpenTruth::open(set)?;
    if let Some(count) = first {
        ensure!(count > 0, "--first 0: there is nothing to score");
        for case in truth.cases.keys().skip(count) {
            read.cases.remove(case);
        }
        truth.cases = truth.cases.into_iter().take(count).collect();
    }
    let score =
        OpenScore::of(&read, &truth, &hash).with_context(|| submission.display().to_string())?;
    let path = submission.with_extension("score.json");
    let json = serde_json::to_string_pretty(&score)? + "\n";
    write_whole(&path, |out| out.write_all(json.as_bytes()))?;
    record_spent(spent, &score)?;
    let figures = Figures::of(&score.outcomes);
    let rows =
        figure_rows(&figures).map(|(name, figure)| format!("| {name} | {} |\n", cell(figure)));
    Ok(format!(
        "seal intact, SHA-256 {hash}\n\n| {} on {} | reached, 95 % interval, cases |\n| --- | --- |\n{}wrote {}",
        score.method,
        score.plant,
        rows.concat(),
        path.display()
    ))
}

/// Figures by their name in tables.
pub(crate) fn figure_rows(f: &Figures) -> [(&'static str, Interval); 16] {
    [
        ("exact", f.exact),
        ("exact or tied", f.exact_or_tied),
        ("one strong", f.strong),
        ("one faint", f.faint),
        ("two", f.two),
        ("nulls alarmed", f.nulls_alarmed),
        ("foreign: unknown", f.foreign_unknown),
        ("foreign: named", f.foreign_named),
        ("place", f.place),
        ("set covers", f.covered),
        ("set size", f.set_size),
        ("calibration error", f.calibration_error),
        ("log score, nats", f.log_score),
        ("closed, of oracle", f.closed),
        ("seconds, median", f.seconds),
        ("simulations", f.simulations),
    ]
}

/// A figure with its interval, or a dash where no case counts.
pub(crate) fn cell(figure: Interval) -> String {
    let Interval { value, low, high, count } = figure;
    let Some(value) = value else { return "-".to_owned() };
    let places = if value.abs() >= 100.0 { 0 } else { 2 };
    format!("{value:.places$} ({low:.places$} .. {high:.places$}), {count}")
}

/// Scores of earlier runs.
///
/// # Errors
/// A file that cannot be read or is no score.
pub fn read_scores(paths: &[PathBuf]) -> anyhow::Result<Vec<OpenScore>> {
    let read = |path: &PathBuf| {
        let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    };
    paths.iter().map(read).collect()
}

const HEADER: &str = "plant,seed,sha256,first_opened_for\n";

/// Plants and seeds whose labels have been opened.
fn spent_seeds(path: &Path) -> anyhow::Result<Vec<(String, u64)>> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let mut spent = Vec::new();
    for (row, line) in text.lines().enumerate().skip(1) {
        let mut cells = line.split(',');
        let (plant, seed) = (cells.next().unwrap_or_default(), cells.next().unwrap_or_default());
        let seed = seed
            .parse()
            .with_context(|| format!("{}, row {}: {seed:?} is no seed", path.display(), row + 1))?;
        spent.push((plant.to_owned(), seed));
    }
    Ok(spent)
}

fn record_spent(path: &Path, score: &OpenScore) -> anyhow::Result<()> {
    let known = spent_seeds(path)?.contains(&(score.plant.clone(), score.seed));
    if known {
        return Ok(());
    }
    let before = if path.is_file() { fs::read_to_string(path)? } else { HEADER.to_owned() };
    let method = score.method.replace([',', '\n'], " ");
    let row = format!("{},{},{},{method}\n", score.plant, score.seed, score.set);
    write_whole(path, |out| out.write_all((before + &row).as_bytes()))?;
    Ok(())
}
