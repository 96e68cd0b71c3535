//! The seal opened: answers against labels, the goals, and simpler methods beside.

use std::{
    path::Path,
    sync::atomic::{AtomicUsize, Ordering::SeqCst},
};

use stretch_blind::{COUNTED_EXCESS, CaseKind, Label, Rate, Score};
use stretch_data::Outputs;
use stretch_gap::{Options, diagnose};
use stretch_problem::RigSimulator;
use stretch_report::{BlindSubject, Goal, blind_page, goals};

use super::{
    blind_answers::{Answers, answers},
    json::Json,
    shared::{say, stage_text, steps, tell},
};
use crate::table::{drawn_tables, table};

pub(super) fn score(folder: &Path, with_oracle: bool, json: &Json) -> anyhow::Result<()> {
    let mut answers = answers(folder)?;
    if with_oracle {
        oracle(folder, &mut answers)?;
    }
    let score = Score::of(&answers.truth, &answers.verdicts)?;
    let goals = goals(&score);
    let subject = BlindSubject {
        score: &score,
        truth: &answers.truth,
        verdicts: &answers.verdicts,
        goals: &goals,
        sha256: answers.seal.sha256(),
    };
    let mut outputs = Outputs::default();
    stage_text(&mut outputs, &folder.join("blind.html"), &blind_page(&subject))?;
    let answer = serde_json::json!({ "score": score, "goals": goals });
    let text = serde_json::to_string_pretty(&answer)? + "\n";
    stage_text(&mut outputs, &folder.join("score.json"), &text)?;
    json.stage(&mut outputs, &answer)?;
    outputs.keep()?;
    json.say(&answer, || {
        say(format!("seal intact, SHA-256 {}\n", answers.seal.sha256()))?;
        say(table(&["goal", "asked", "reached", "count", "95 % interval", "met"], rows(&goals)))?;
        say(format!("too few: a single case decides.\n\n{}", drawn_tables(&score.to_string())))?;
        tell(format!("wrote {}", folder.join("blind.html").display()))
    })
}

/// Share, count and Wilson's interval of a rate.
fn rate_cells(rate: Option<&Rate>) -> Vec<String> {
    match rate.and_then(|r| Some((r, r.share()?, r.wilson()?))) {
        Some((r, share, (low, high))) => vec![
            format!("{share:.3}"),
            format!("{} of {}", r.hits, r.cases),
            format!("{low:.3} .. {high:.3}"),
        ],
        None => vec!["-".to_owned(), "no case".to_owned(), String::new()],
    }
}

fn rows(goals: &[Goal]) -> impl Iterator<Item = Vec<String>> + '_ {
    goals.iter().map(|g| {
        let mut row = vec![g.what.to_owned(), g.goal.clone()];
        match (g.rate, g.value) {
            (None, Some(value)) => {
                row.extend([format!("{value:.3}"), String::new(), String::new()])
            }
            (rate, _) => row.extend(rate_cells(rate.as_ref())),
        }
        row.push(g.verdict().to_owned());
        row
    })
}

fn counts(label: &Label) -> bool {
    label.kind == CaseKind::Single && label.excess >= COUNTED_EXCESS
}

/// Closed gap of a fit whose catalogue holds the true effect alone.
fn oracle(folder: &Path, answers: &mut Answers) -> anyhow::Result<()> {
    let wanted: Vec<(usize, Vec<String>)> = answers
        .verdicts
        .iter()
        .enumerate()
        .filter_map(|(i, v)| {
            let label = answers.truth.cases.get(&v.case).filter(|l| counts(l))?;
            Some((i, label.effects.clone()))
        })
        .collect();
    let bar = steps("fits that know the label", wanted.len());
    let next = AtomicUsize::new(0);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let verdicts = &answers.verdicts;
    let found: Vec<(usize, f64)> = std::thread::scope(|scope| {
        let worker = || {
            let mut found = Vec::new();
            while let Some((i, effects)) = wanted.get(next.fetch_add(1, SeqCst)) {
                let closed = known_fit(&folder.join(&verdicts[*i].case), effects);
                found.extend(closed.map(|c| (*i, c)));
                bar.inc(1);
            }
            found
        };
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        threads.into_iter().flat_map(|t| t.join().unwrap_or_default()).collect()
    });
    bar.finish_and_clear();
    for (i, closed) in found {
        answers.verdicts[i].closed_oracle = Some(closed);
    }
    Ok(())
}

fn known_fit(case: &Path, effects: &[String]) -> Option<f64> {
    let names = stretch_sim::CATALOGUE.iter().map(|e| e.name);
    let without: Vec<&str> = names.filter(|name| effects.iter().all(|e| e != name)).collect();
    let catalogue = stretch_sim::Catalogue::default().without(&without).ok()?;
    let simulator = RigSimulator::read(case, None, &catalogue).ok()?;
    let options = Options { threads: 1, ..Options::default() };
    let (diagnosis, _) =
        diagnose(&simulator, &options, &|_| (), &stretch_data::interrupted).ok()?;
    diagnosis.candidates.first().map(|c| c.closed)
}
