//! Scores each family of forms with a diagnosis that was calibrated without this family: `cargo run
//! --release -p stretch-challenge --example leave_family_out -- FOLDER`.
//!
//! FOLDER holds cases of several families (`challenge make`) that were diagnosed once
//! (`challenge run`). For each family, the thresholds of `unknown` are calibrated on the answers of
//! the other families, and the cases of the family are diagnosed again with these thresholds.

use std::{fs, path::Path};

use rayon::prelude::*;
use stretch_blind::{Family, Label, Score, Truth, Verdict};
use stretch_challenge::{ANSWER, Case, calibrated, diagnosed};
use stretch_gap::{Diagnosis, Options};

fn main() -> anyhow::Result<()> {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: leave_family_out FOLDER");
        std::process::exit(2);
    };
    let folder = Path::new(&folder);
    let (truth, _) = Truth::open(folder)?;
    let mut cases: Vec<Case> = Vec::new();
    for (name, label) in &truth.cases {
        let text = fs::read_to_string(folder.join(name).join(ANSWER))?;
        cases.push((label.clone(), serde_json::from_str::<Diagnosis>(&text)?));
    }
    let mut judged: Vec<Verdict> = Vec::new();
    for family in Family::ALL {
        let others: Vec<&Case> = cases.iter().filter(|(label, _)| label.family != family).collect();
        let own: Vec<_> = truth.cases.iter().filter(|(_, label)| label.family == family).collect();
        if own.is_empty() {
            continue;
        }
        let thresholds = calibrated(&others);
        println!("{family}: {thresholds:?}");
        let options = Options { thresholds, threads: 1, ..Options::default() };
        let verdicts: anyhow::Result<Vec<Verdict>> =
            own.par_iter().map(|(name, label)| answer(folder, name, label, &options)).collect();
        judged.extend(verdicts?);
    }
    println!("{}", serde_json::to_string_pretty(&Score::of(&truth, &judged)?)?);
    Ok(())
}

fn answer(folder: &Path, name: &str, label: &Label, options: &Options) -> anyhow::Result<Verdict> {
    let struck: Vec<&String> = label.struck.iter().collect();
    let (diagnosis, _) = diagnosed(&folder.join(name), &struck, options, &|_| ())?;
    Ok(Verdict::from_diagnosis(name, &serde_json::to_value(&diagnosis)?)?)
}
