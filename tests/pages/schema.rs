//! Validates diagnoses written by the program against their JSON Schema.

use std::process::Command;

use super::markdown::root;
use crate::support::{Scratch, json_to, runs, stretch};

/// Python program that reads a schema and documents and prints the violations.
const VALIDATOR: &str = r#"
import json, sys, jsonschema
schema, *documents = (json.load(open(path)) for path in sys.argv[1:])
jsonschema.Draft202012Validator.check_schema(schema)
faults = [f"{fault.json_path}: {fault.message}" for d in documents for fault in jsonschema.Draft202012Validator(schema).iter_errors(d)]
sys.exit("\n".join(faults) or 0)
"#;

#[test]
#[ignore = "needs python3 with jsonschema; ./ci.sh runs it"]
fn with_jsonschema_a_diagnosis_conforms_to_its_schema() {
    let scratch = Scratch::new();
    let bench = scratch.path("bench");
    let mut documents = Vec::new();
    for effect in [None, Some("gauge_hysteresis:h=0.2,s=0.012")] {
        let mut simulate = stretch();
        simulate.args(["simulate", "--protocol", "pulses", "--force", "--out"]).arg(&bench);
        runs(simulate.args(effect.map(|effect| ["--effect", effect]).iter().flatten()));
        let gauge = ["--reference", "length_mm", "--signal", "bridge_v"];
        // A complete rig, and its gauge alone.
        for (place, columns) in
            [(bench.clone(), &gauge[..0]), (bench.join("pulses_1.csv"), &gauge[..])]
        {
            let json = scratch.path(&format!("{}.json", documents.len()));
            let mut diagnose = stretch();
            diagnose.args(["diagnose", "--verbose"]).arg(json_to(&json));
            runs(diagnose.arg(place).args(columns));
            documents.push(json);
        }
    }
    let schema = root().join("book/src/reference/diagnosis.schema.json");
    let mut python = Command::new("python3");
    let output =
        python.args(["-c", VALIDATOR]).arg(schema).args(documents).output().expect("python3");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
