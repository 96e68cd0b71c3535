//! The complete loop as a new user types it: a named effect, a simulator that agrees, a calibration
//! that uses the effect, and C code for a board.

use std::{fs, process::Command};

use crate::support::{Scratch, fails, json_to, runs, stretch};

/// Simulates a data set of the paper's protocol with an effect of the gauge.
fn bench(scratch: &Scratch, effect: &str) -> std::path::PathBuf {
    let folder = scratch.path("bench");
    runs(
        stretch()
            .args(["simulate", "--protocol", "paper", "--effect", effect, "--seed", "3", "--out"])
            .arg(&folder),
    );
    folder
}

fn rmse(said: &str, model: &str) -> f64 {
    let value: serde_json::Value = serde_json::from_str(said).unwrap();
    let trials = value["trials"].as_array().unwrap();
    let errors = trials.iter().map(|t| {
        let methods = t["methods"].as_array().unwrap();
        let own = methods.iter().find(|m| m["method"] == model).unwrap();
        own["rmse"].as_f64().unwrap().powi(2)
    });
    (errors.sum::<f64>() / trials.len() as f64).sqrt()
}

#[test]
fn a_name_makes_the_calibration_better_and_goes_to_the_board() {
    let scratch = Scratch::new();
    let bench = bench(&scratch, "gauge_relaxation:c=0.3,tau=0.4");
    let (cal, paper, d) =
        (scratch.path("diagnosed.json"), scratch.path("poly13.json"), scratch.path("d.json"));
    let said = runs(
        stretch()
            .arg("calibrate")
            .arg(&bench)
            .args(["--model", "diagnosed", "-v", "--out"])
            .arg(&cal),
    );
    assert!(said.contains("gauge_relaxation c") && said.contains("the gauge alone"), "{said}");
    runs(stretch().arg("calibrate").arg(&bench).arg("--out").arg(&paper));
    let judged = runs(
        stretch()
            .arg("evaluate")
            .arg("--json")
            .arg("--calibration")
            .arg(&cal)
            .arg("--calibration")
            .arg(&paper)
            .arg(&bench),
    );
    let (own, poly13) = (rmse(&judged, "diagnosed"), rmse(&judged, "poly13"));
    assert!(own < 0.5 * poly13, "{own} {poly13}");

    // The live output contains the standard deviation.
    let trial = fs::read_to_string(bench.join("arbitrary_2.csv")).unwrap();
    let live = stretch()
        .arg("apply")
        .arg("--calibration")
        .arg(&cal)
        .arg("-")
        .write_stdin(trial)
        .output()
        .unwrap();
    let text = String::from_utf8(live.stdout).unwrap();
    let mut lines = text.lines();
    assert!(lines.next().unwrap().ends_with("branch,domain,sd_mm"));
    let last: Vec<&str> = lines.last().unwrap().split(',').collect();
    assert!(last[5].parse::<f64>().unwrap() > 0.0, "{last:?}");

    // Calibration from a diagnosis of the complete rig, and its export to C.
    runs(stretch().arg("diagnose").arg(&bench).arg("--no-next").arg(json_to(&d)));
    let said = runs(
        stretch()
            .arg("calibrate")
            .arg(&bench)
            .args(["--model", "diagnosed", "--from"])
            .arg(&d)
            .arg("--out")
            .arg(scratch.path("from.json")),
    );
    assert!(said.contains("a diagnosis of bench") && !said.contains("another rig"), "{said}");
    let other = scratch.loops("other.csv", 20.0, 1.1);
    let mut command = stretch();
    command.arg("calibrate").arg(&other).args(["--model", "diagnosed", "--from"]).arg(&d);
    let said = runs(command.arg("--out").arg(scratch.path("other.json")));
    assert!(said.contains("of bench, but these trials are of other"), "{said}");
    let c = scratch.path("c");
    runs(stretch().arg("export").arg("--calibration").arg(&cal).arg("--c").arg(&c));
    let main = scratch.write(
        "main.c",
        "#include \"stretch.h\"\nint main(void) { return stretch_self_test(); }\n",
    );
    let program = scratch.path("program");
    let mut cc = Command::new("cc");
    cc.args(["-std=c99", "-I"]).arg(&c).arg(main).arg("-o").arg(&program).arg("-lm");
    assert!(cc.status().unwrap().success());
    assert!(Command::new(program).status().unwrap().success());
}

#[test]
fn a_diagnosis_that_cannot_help_is_refused_with_what_to_do() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 20.0, 1.1);
    let ask = |name: &str, text: &str, says: &[&str]| {
        let d = scratch.write(name, text);
        let out = scratch.path("cal.json");
        let mut command = stretch();
        command.arg("calibrate").arg(&trial).args(["--model", "diagnosed", "--from"]).arg(&d);
        fails(command.arg("--out").arg(&out), says);
        assert!(!out.exists());
    };
    ask("no.json", "{\"rows\": 3}", &["no.json", "stretch diagnose --json="]);
    ask("newer.json", "{\"schema\": 7}", &["newer.json", "schema 7", "newer"]);
    // A diagnosis without any effect, and a diagnosis that names only an effect of another stage.
    let folder = scratch.path("quiet");
    runs(stretch().args(["simulate", "--protocol", "pulses", "--out"]).arg(&folder));
    let d = scratch.path("quiet.json");
    runs(stretch().arg("diagnose").arg(&folder).arg(json_to(&d)));
    let quiet = fs::read_to_string(&d).unwrap();
    ask("none.json", &quiet, &["none.json", "no effect of the gauge", "--model observer"]);
}
