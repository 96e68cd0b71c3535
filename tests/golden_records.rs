//! Golden calibrations: the coefficients that every model fits to one simulated session.
//!
//! `STRETCH_BLESS=1 cargo test golden_records` writes the file anew. The commit message must
//! explain why a number changed.

use std::{collections::BTreeMap, env, fs, path::Path};

use serde_json::Value;

use crate::support::{Scratch, runs, stretch};

const MODELS: [&str; 5] = ["linear", "poly13", "observer", "history", "diagnosed"];

/// The parts of a calibration file that are results of the fit.
const PARTS: [&str; 4] = ["signal_range", "target_range", "dead_band", "model"];

#[test]
fn every_model_fits_the_same_numbers_as_before() {
    let scratch = Scratch::in_memory();
    let session = scratch.path("session");
    let effect = "gauge_relaxation:c=0.3,tau=0.4";
    let simulate = ["simulate", "--protocol", "paper", "--effect", effect, "--seed", "3", "--out"];
    runs(stretch().args(simulate).arg(&session));
    let found: BTreeMap<&str, Value> =
        MODELS.iter().map(|model| (*model, fitted(&scratch, &session, model))).collect();
    let found = serde_json::to_value(found).unwrap();

    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden_records.json");
    if env::var_os("STRETCH_BLESS").is_some() {
        fs::write(&path, serde_json::to_string_pretty(&found).unwrap() + "\n").unwrap();
    }
    let golden: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    for model in MODELS {
        assert_eq!(found[model], golden[model], "{model}");
    }
}

fn fitted(scratch: &Scratch, session: &Path, model: &str) -> Value {
    let out = scratch.path(&format!("{model}.json"));
    runs(stretch().arg("calibrate").arg(session).args(["--model", model, "--out"]).arg(&out));
    let record: Value = serde_json::from_str(&fs::read_to_string(out).unwrap()).unwrap();
    PARTS.iter().map(|part| ((*part).to_owned(), record[*part].clone())).collect()
}
