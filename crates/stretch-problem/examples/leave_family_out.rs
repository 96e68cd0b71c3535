//! Every family of forms judged by a diagnosis that was calibrated without it:
//! `cargo run --release -p stretch-problem --example leave_family_out -- FOLDER`.
//!
//! FOLDER holds cases of several families (`stretch blind make --family all`) that were diagnosed once (`stretch blind run`). For each
//! family temperature and borders are calibrated on the answers of the others, and its own cases are diagnosed anew with them.

#[path = "support/calibration.rs"]
mod calibration;

use std::{collections::BTreeMap, fs, path::Path};

use calibration::{Case, calibrated};
use rayon::prelude::*;
use stretch_blind::{Family, Label, Score, Seal, Verdict};
use stretch_gap::{Diagnosis, Options, diagnose};
use stretch_problem::RigSimulator;
use stretch_sim::Catalogue;

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: leave_family_out FOLDER");
        std::process::exit(2);
    };
    let folder = Path::new(&folder);
    let (_, truth) = Seal::open(folder)?;
    let mut cases: Vec<Case> = Vec::new();
    for (name, label) in &truth.cases {
        let text = fs::read_to_string(folder.join(name).join("diagnosis.json"))?;
        cases.push((label.clone(), serde_json::from_str::<Diagnosis>(&text)?));
    }
    let mut runs: BTreeMap<Family, Vec<Verdict>> = BTreeMap::new();
    for family in Family::ALL {
        let others: Vec<&Case> = cases.iter().filter(|(label, _)| label.family != family).collect();
        let own: Vec<_> = truth.cases.iter().filter(|(_, label)| label.family == family).collect();
        if own.is_empty() {
            continue;
        }
        let thresholds = calibrated(&others);
        println!("{family}: {thresholds:?}");
        let options = Options { thresholds, threads: 1, ..Options::default() };
        let verdicts: Result<Vec<Verdict>, Failure> =
            own.par_iter().map(|(name, label)| answer(folder, name, label, &options)).collect();
        runs.insert(family, verdicts?);
    }
    println!("{}", Score::leave_family_out(&truth, &runs)?);
    Ok(())
}

fn answer(folder: &Path, name: &str, label: &Label, options: &Options) -> Result<Verdict, Failure> {
    let struck: Vec<&String> = label.struck.iter().collect();
    let catalogue = Catalogue::default().without(&struck)?;
    let simulator = RigSimulator::read(&folder.join(name), None, &catalogue)?;
    let (diagnosis, _) = diagnose(&simulator, options, &|_| (), &|| false)?;
    Ok(Verdict::from_diagnosis(name, &serde_json::to_value(&diagnosis)?)?)
}
