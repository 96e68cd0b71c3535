//! Calibrates the thresholds that decide when a gap is `unknown`, on diagnosed cases with labels:
//! `cargo run --release -p stretch-challenge --example thresholds -- [--write] FOLDER...`.
//!
//! `challenge make` and `challenge run`, or `dev_score`, make such folders. The thresholds that
//! control the search itself (`null_excess`, `rise`, `share`, `model_discrepancy`) act while a case
//! is diagnosed, so they are not changed.

use std::{fs, path::Path};

use stretch_blind::Truth;
use stretch_challenge::{ANSWER, Case, calibrated};
use stretch_gap::Diagnosis;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut folders: Vec<String> = std::env::args().skip(1).collect();
    let is_written = folders.first().is_some_and(|a| a == "--write");
    if is_written {
        folders.remove(0);
    }
    if folders.is_empty() {
        eprintln!("usage: thresholds [--write] FOLDER...");
        std::process::exit(2);
    }
    let mut cases: Vec<Case> = Vec::new();
    let mut seeds = Vec::new();
    for folder in &folders {
        let (truth, _) = Truth::open(Path::new(folder))?;
        seeds.extend(truth.seed.map(|seed| seed.to_string()));
        for (name, label) in truth.cases {
            let file = Path::new(folder).join(&name).join(ANSWER);
            if let Ok(text) = fs::read_to_string(&file) {
                cases.push((label, serde_json::from_str::<Diagnosis>(&text)?));
            }
        }
    }
    let after = calibrated(&cases.iter().collect::<Vec<_>>());
    let text = format!(
        "# unknown_excess, unknown_share and unknown_odds: calibrated on {} development cases, seeds {}, with\n\
         #   cargo run --release -p stretch-challenge --example thresholds -- --write FOLDER...\n\
         # temperature and rho: on 760 cases of the seeds 11, 12 and 1000001; unknown_soft: on 135 cases of the seeds 2101, 2102 and 2103.\n\
         # least_gap was chosen, not calibrated. The other values control the search; they were chosen by hand on development cases.\n{}",
        cases.len(),
        seeds.join(", "),
        toml::to_string(&after)?
    );
    print!("{text}");
    if is_written {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/stretch-gap/thresholds.toml");
        fs::write(path, text)?;
    }
    Ok(())
}
