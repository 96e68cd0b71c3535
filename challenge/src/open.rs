//! Scores submissions to open sets, and writes the leaderboard, a page of one file.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use serde::de::DeserializeOwned;
use stretch_blind::{Figures, Interval, OpenScore, OpenTruth, Outcome, Submission};
use stretch_data::files::write_whole;
use stretch_report::kit::{Figure, Page, Table};

use crate::{make::record_spent, page::reliability_figure, text::table};

/// Scores a submission against a set and its labels, writes `SUBMISSION.score.json`, and records
/// the seed as spent. `first` limits the set and the submission to that number of cases, from the
/// first.
///
/// # Errors
/// A submission that cannot be read or uses names that the set does not have, a broken seal.
pub fn score_open(
    submission: &Path,
    set: &Path,
    spent: &Path,
    first: Option<usize>,
) -> anyhow::Result<String> {
    let mut read: Submission = read_json(submission)?;
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
    let rows = Figures::of(&score.outcomes).rows;
    let head = [&*format!("{} on {}", score.method, score.plant), "reached, 95 % interval, cases"];
    let rows = table(head, rows.into_iter().map(|(name, figure)| [name, cell(&figure)]));
    Ok(format!("seal intact, SHA-256 {hash}\n\n{rows}\nwrote {}", path.display()))
}

/// Formats a statistic with its interval; a dash if no case counts.
fn cell(figure: &Interval) -> String {
    let Interval { value, low, high, count } = *figure;
    let Some(value) = value else { return "-".to_owned() };
    let places = if value.abs() >= 100.0 { 0 } else { 2 };
    format!("{value:.places$} ({low:.places$} .. {high:.places$}), {count}")
}

fn read_json<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

/// Returns the page of scores: a row for each method and plant, a row for each method over all its plants, and
/// reliability diagrams. The rows of a plant are sorted by the share of exact answers.
///
/// Results of methods over several plants are comparable only if all methods answered the same
/// cases. The page lists the sets.
///
/// # Errors
/// A file that cannot be read or is not a score, an empty list, or two scores of one method on one
/// set.
pub fn board(paths: &[PathBuf]) -> anyhow::Result<String> {
    let scores = paths.iter().map(|path| read_json(path));
    let scores: Vec<OpenScore> = scores.collect::<anyhow::Result<_>>()?;
    ensure!(!scores.is_empty(), "there is no score to show: name at least one .score.json");
    let mut rows: BTreeMap<(String, String), Vec<Outcome>> = BTreeMap::new();
    let mut seen = Vec::new();
    for score in &scores {
        let key = (&score.method, &score.set);
        ensure!(!seen.contains(&key), "{} is there twice on {}", score.method, score.set);
        seen.push(key);
        for plant in [score.plant.as_str(), "all"] {
            let row = rows.entry((plant.to_owned(), score.method.clone())).or_default();
            row.extend(score.outcomes.iter().cloned());
        }
    }
    let mut figures: Vec<(String, String, Figures)> = rows
        .into_iter()
        .map(|((plant, method), cases)| (plant, method, Figures::of(&cases)))
        .collect();
    // the first statistic is the share of exact answers
    let exact = |figures: &Figures| figures.rows[0].1.value.unwrap_or(0.0);
    figures.sort_by(|a, b| a.0.cmp(&b.0).then(exact(&b.2).total_cmp(&exact(&a.2))));
    let mut page = Page::new(
        "What is missing from the simulator?",
        "Each cell: value, 95\u{a0}% interval by bootstrap over cases, cases that count.",
    );
    let names = figures[0].2.rows.iter().map(|(name, _)| name.as_str());
    let head: Vec<&str> = ["plant", "method"].into_iter().chain(names).collect();
    let row = |(plant, method, figures): &(String, String, Figures)| {
        let cells = figures.rows.iter().map(|(_, figure)| cell(figure));
        [plant.clone(), method.clone()].into_iter().chain(cells).collect()
    };
    page.table(&Table::new("Figures by plant and method", &head, figures.iter().map(row)));
    page.section("Reliability", "");
    let whole = figures.iter().filter(|(plant, ..)| plant == "all");
    let diagrams: Vec<(Figure, String)> = whole
        .map(|(_, method, figures)| (reliability_figure(&figures.reliability), method.clone()))
        .collect();
    page.figures(&diagrams);
    page.section("Set up", "");
    let setups: BTreeMap<&str, &String> =
        scores.iter().map(|s| (s.method.as_str(), &s.setup)).collect();
    page.facts(&setups.into_iter().map(|(method, s)| (method, s.clone())).collect::<Vec<_>>());
    page.section("Sets", "");
    let set = |s: &OpenScore| {
        let OpenScore { plant, seed, set, outcomes, .. } = s;
        (set.clone(), format!("{plant}, seed {seed}, {} cases: {set}", outcomes.len()))
    };
    let sets: BTreeMap<String, String> = scores.iter().map(set).collect();
    page.list(&sets.into_values().collect::<Vec<_>>());
    Ok(page.finish())
}
