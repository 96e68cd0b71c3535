//! Submissions to sets that strangers solve: their scores, and the leaderboard, a page of one file whose table is
//! sorted by a click on a column.

use std::{
    collections::BTreeMap,
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use serde::de::DeserializeOwned;
use stretch_blind::{Figures, Interval, OpenScore, OpenTruth, Outcome, Submission};
use stretch_data::files::write_whole;
use stretch_report::kit::escape;

use crate::make::record_spent;

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
    let rows: String =
        rows.iter().map(|(name, figure)| format!("| {name} | {} |\n", cell(figure))).collect();
    Ok(format!(
        "seal intact, SHA-256 {hash}\n\n| {} on {} | reached, 95 % interval, cases |\n| --- | --- |\n{}wrote {}",
        score.method,
        score.plant,
        rows,
        path.display()
    ))
}

/// A figure with its interval, or a dash where no case counts.
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

/// The page of scores: a row for each method and plant, a row for each method over all its plants, and reliability diagrams.
///
/// Methods over several plants are compared only if each was asked the same cases; the page states
/// the sets of each row.
///
/// # Errors
/// A file that cannot be read or is no score, no score, or two of one method on one set.
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
    let figures: Vec<(String, String, usize, Figures)> = rows
        .into_iter()
        .map(|((plant, method), cases)| (plant, method, cases.len(), Figures::of(&cases)))
        .collect();
    let mut table = String::from("<tr><th>plant</th><th>method</th><th>cases</th>");
    for (name, _) in &figures[0].3.rows {
        let _ = write!(table, "<th>{name}</th>");
    }
    table.push_str("</tr></thead><tbody>\n");
    for (plant, method, cases, figures) in &figures {
        let _ = write!(
            table,
            "<tr><td>{plant}</td><td>{}</td><td data-v={cases}>{cases}</td>",
            escape(method)
        );
        for (_, figure) in &figures.rows {
            let key = figure.value.map_or(String::new(), |v| v.to_string());
            let _ = write!(table, "<td data-v=\"{key}\">{}</td>", cell(figure));
        }
        table.push_str("</tr>\n");
    }
    let diagrams: String = figures
        .iter()
        .filter(|(plant, ..)| plant == "all")
        .map(|(_, method, cases, figures)| diagram(method, *cases, figures))
        .collect();
    let setups: BTreeMap<&str, &str> =
        scores.iter().map(|s| (s.method.as_str(), s.setup.as_str())).collect();
    let setups: String = setups
        .iter()
        .map(|(method, setup)| format!("<dt>{}</dt><dd>{}</dd>\n", escape(method), escape(setup)))
        .collect();
    let sets: BTreeMap<&str, String> = scores
        .iter()
        .map(|s| {
            (s.set.as_str(), format!("{}, seed {}, {} cases", s.plant, s.seed, s.outcomes.len()))
        })
        .collect();
    let sets: String = sets
        .iter()
        .map(|(hash, what)| format!("<li>{}: <code>{hash}</code></li>\n", escape(what)))
        .collect();
    Ok(format!(
        "{HEAD}{table}{MIDDLE}{diagrams}<h2>Set up</h2><dl>\n{setups}</dl><h2>Sets</h2><ul>\n{sets}</ul>{TAIL}"
    ))
}

const HEAD: &str = r#"<!doctype html><html lang="en"><meta charset="utf-8"><title>Challenge: leaderboard</title>
<style>body{font:15px/1.5 system-ui,sans-serif;margin:2em}table{border-collapse:collapse;font-size:13px}
th,td{padding:.3em .6em;border-bottom:1px solid #ccc;text-align:right;white-space:nowrap}th{cursor:pointer}
th:nth-child(-n+2),td:nth-child(-n+2){text-align:left}figure{display:inline-block;margin:.5em}div{overflow-x:auto}</style>
<h1>What is missing from the simulator?</h1><p>Each cell: value, 95 % interval by bootstrap over cases, cases that count.
A click on a column sorts by it, a second click the other way round.</p><div><table><thead>"#;

const MIDDLE: &str = "</tbody></table></div><h2>Reliability</h2><p>Across: the greatest probability of an answer. Up: how often it was \
right. The area of a dot is the number of cases.</p>";

const TAIL: &str = r#"<script>document.querySelectorAll("th").forEach((th,i)=>th.onclick=()=>{const b=document.querySelector("tbody"),
d=th.dataset.d=-(th.dataset.d||1),k=r=>r.children[i].dataset.v??r.children[i].textContent;
[...b.rows].sort((x,y)=>{const[p,q]=[k(x),k(y)];if(p===""||q==="")return(p==="")-(q==="");
return d*(isNaN(p)||isNaN(q)?q.localeCompare(p):q-p)}).forEach(r=>b.append(r))})</script></html>
"#;

/// A square of 200 points with the diagonal and a dot for each tenth.
fn diagram(method: &str, cases: usize, figures: &Figures) -> String {
    let mut dots = String::new();
    for bin in &figures.reliability.bins {
        let Some(right) = bin.right.share() else { continue };
        let n = bin.right.cases;
        let radius = 2.0 + 14.0 * (n as f64 / cases as f64).sqrt();
        let (x, y) = (20.0 + 160.0 * bin.stated, 180.0 - 160.0 * right);
        let _ = write!(
            dots,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"#36c\" fill-opacity=\".6\"><title>{n} cases</title></circle>"
        );
    }
    let name = escape(method);
    format!(
        "<figure><svg width=\"200\" height=\"200\" role=\"img\" aria-label=\"reliability of {name}\"><rect x=\"20\" y=\"20\" width=\"160\" \
         height=\"160\" fill=\"none\" stroke=\"#999\"/><path d=\"M20 180L180 20\" stroke=\"#999\"/>{dots}</svg><figcaption>{name}</figcaption></figure>\n"
    )
}
