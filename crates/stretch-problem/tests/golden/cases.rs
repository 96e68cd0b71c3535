//! Compares the answers on generated rigs and on measured machines with golden files. These tests are ignored, because
//! the generators are separate programs.
//!
//! ```sh
//! cargo run --release -p stretch-challenge -- make --cases 30 --seed 5252 --out CASES/own
//! STRETCH_CASES=CASES cargo test --release -p stretch-problem --test it golden -- --ignored
//! ```
//!
//! `CASES/independent` holds the cases of another simulator of the same rig (form 3, seed 4101, 30
//! cases, causes of the set `dev`), and `CASES/machines` the folders that
//! `examples/machines/machines.py` prepares from measured recordings.

use std::{env, fs, path::PathBuf};

use rayon::prelude::*;
use stretch_problem::{Problem, Reading};

use super::summary::{assert_golden, summarize};

fn answers(set: &str) -> String {
    let folder =
        env::var_os("STRETCH_CASES").map(PathBuf::from).expect("STRETCH_CASES names the cases");
    let entries = fs::read_dir(folder.join(set)).expect("the cases");
    let mut cases: Vec<PathBuf> = entries.map(|entry| entry.expect("a case").path()).collect();
    cases.retain(|path| path.join("dataset.toml").exists() || path.join("problem.toml").exists());
    cases.sort();
    let answer = |case: &PathBuf| {
        let name = case.file_name().expect("a name").to_string_lossy().into_owned();
        let file = case.join("problem.toml");
        let path = if case.join("dataset.toml").exists() { case } else { &file };
        match Problem::read(path, &Reading::default()) {
            Ok(problem) => summarize(&name, &problem),
            Err(error) => format!("{name} refused: {error}\n"),
        }
    };
    cases.par_iter().map(answer).collect()
}

#[test]
#[ignore = "needs cases of the blind generator: STRETCH_CASES names the folder that holds `own`"]
fn with_cases_of_the_blind_generator() {
    assert_golden("own.txt", &answers("own"));
}

#[test]
#[ignore = "needs cases of an independent generator: STRETCH_CASES names the folder that holds `independent`"]
fn with_cases_of_an_independent_generator() {
    assert_golden("independent.txt", &answers("independent"));
}

#[test]
#[ignore = "needs measured machines: STRETCH_CASES names the folder that holds `machines`"]
fn with_cases_of_measured_machines() {
    assert_golden("machines.txt", &answers("machines"));
}
