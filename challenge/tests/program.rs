//! Tests of the program `challenge` as a separate process.

use std::{fs, path::Path};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::tempdir;

fn challenge(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_challenge"));
    command.current_dir(folder).args(arguments);
    command
}

/// Runs the program, which must succeed, and returns its output.
#[track_caller]
fn runs(command: &mut Command) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must fail with a message that contains a text.
#[track_caller]
fn fails(command: &mut Command, code: i32, part: &str) {
    let output = command.output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{message}");
    assert!(message.contains(part) && !message.contains("panicked"), "{message}");
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_check_keeps_its_labels_sealed() {
    let scratch = tempdir().unwrap();
    let here = scratch.path();
    let check = here.join("check");
    let make = ["make", "--cases", "2", "--seed", "11", "--out", "check"];
    let text = runs(&mut challenge(here, &make));
    let hash = text.split_whitespace().last().unwrap().to_owned();
    assert_eq!(hash.len(), 64);
    fails(&mut challenge(here, &make), 1, "check");
    // an existing answer is not changed
    let answer = r#"{"schema":2,"verdict":"no_gap","named":[],"ambiguous":[],"candidates":[],"runtime_s":0.5}"#;
    for case in ["case-000", "case-001"] {
        fs::write(check.join(case).join("diagnosis.json"), answer).unwrap();
    }
    assert!(runs(&mut challenge(here, &["run", "check"])).contains("answered 2 of 2"));
    let text = runs(&mut challenge(here, &["score", "check"]));
    assert!(text.contains(&hash) && text.contains("verdict other than none on nulls"), "{text}");
    let page = fs::read_to_string(check.join("report.html")).unwrap();
    let page = testkit::page::without_program(&page);
    assert!(page.contains(&hash) && page.contains("Every miss") && !page.contains("NaN"));
    // a change of the labels after sealing is detected
    let labels = check.join("sealed/truth.json");
    let text = fs::read_to_string(&labels).unwrap();
    fs::write(&labels, text.replacen("\"excess\": ", "\"excess\": 1", 1)).unwrap();
    fails(&mut challenge(here, &["score", "check"]), 1, "seal");
}

#[test]
fn a_case_is_diagnosed_away_from_its_label() {
    let scratch = tempdir().unwrap();
    let here = scratch.path();
    runs(&mut challenge(here, &["make", "--cases", "1", "--seed", "3", "--out", "check"]));
    let case = here.join("check/case-000");
    let rooms = here.join("rooms");
    fs::create_dir(&rooms).unwrap();
    let run = |more: &[&str]| {
        let mut command = challenge(here, &[&["run", "check"], more].concat());
        runs(command.env("TMPDIR", &rooms))
    };
    assert!(run(&[]).contains("answered 1 of 1 cases, 0 refused"));
    let answer = json(&case.join("diagnosis.json"));
    assert_eq!(
        (answer["data_set"].as_str(), answer["schema"].as_u64()),
        (Some("case-000"), Some(2))
    );
    assert_eq!(fs::read_dir(&rooms).unwrap().count(), 0);
    // for a case that cannot be diagnosed, the reason is stored instead of an answer
    fs::remove_file(case.join("diagnosis.json")).unwrap();
    let trial = case.join("arbitrary_1.csv");
    let text = fs::read_to_string(&trial).unwrap();
    fs::write(&trial, text.replacen("\n0.00,", "\n0.00,3", 1)).unwrap();
    assert!(run(&[]).contains("answered 0 of 1 cases, 1 refused"));
    let why = fs::read_to_string(case.join("refusal.txt")).unwrap();
    assert!(why.contains("inlet") && why.contains("from 0 to 1"), "{why}");
    assert_eq!(fs::read_dir(&rooms).unwrap().count(), 0);
}

#[cfg(unix)]
#[test]
fn another_program_is_asked_in_the_same_room() {
    let scratch = tempdir().unwrap();
    let here = scratch.path();
    runs(&mut challenge(here, &["make", "--cases", "1", "--out", "check"]));
    let script = "#!/bin/sh\n[ \"$1 $2 $3\" = 'diagnose . --json=diagnosis.json' ] || exit 2\n\
                  ls .. * >listed.txt\necho '{\"verdict\": \"no_gap\"}' >diagnosis.json\n";
    let program = here.join("other.sh");
    fs::write(&program, script).unwrap();
    let mut permissions = fs::metadata(&program).unwrap().permissions();
    std::os::unix::fs::PermissionsExt::set_mode(&mut permissions, 0o755);
    fs::set_permissions(&program, permissions).unwrap();
    let program = program.to_str().unwrap();
    runs(&mut challenge(here, &["run", "check", "--program", program]));
    assert_eq!(json(&here.join("check/case-000/diagnosis.json"))["verdict"], "no_gap");
    let missing = ["run", "check", "--again", "--program", "./there-is-none"];
    fails(&mut challenge(here, &missing), 1, "there-is-none");
}

#[test]
fn counts_that_nobody_means_are_refused() {
    let scratch = tempdir().unwrap();
    let asked = ["--cases", "99999999999"];
    fails(&mut challenge(scratch.path(), &asked), 2, "not a number of cases up to 100000");
    fails(&mut challenge(scratch.path(), &["--cases", "0"]), 1, "there is nothing to make");
    fails(&mut challenge(scratch.path(), &[]), 2, "--cases");
    assert_eq!(fs::read_dir(scratch.path()).unwrap().count(), 0);
}

/// Returns a submission that answers every case with "nothing is missing".
fn silent(set: &Path, cases: usize) -> Value {
    let seal = fs::read_to_string(set.join("seal.sha256")).unwrap();
    let answer = serde_json::json!({
        "probabilities": [{"effects": [], "probability": 1.0}],
        "verdict": "none", "place": null, "closed_share": 0.0, "seconds": 0.1, "simulations": 1
    });
    let answers: serde_json::Map<String, Value> =
        (0..cases).map(|n| (format!("case-{n:03}"), answer.clone())).collect();
    serde_json::json!({
        "schema": 1, "method": "silent", "set": seal.split_whitespace().next(), "cases": answers
    })
}

#[test]
fn a_set_is_made_whole_or_not_at_all_and_may_be_scored_in_part() {
    let scratch = tempdir().unwrap();
    let here = scratch.path();
    let make = ["make", "--plant", "thermal", "--cases", "5", "--seed", "11", "--out", "set"];
    runs(&mut challenge(here, &make));
    assert!(here.join("set-sealed/truth.json").is_file());
    fs::create_dir(here.join("other-sealed")).unwrap();
    fs::write(here.join("other-sealed/truth.json"), "{}").unwrap();
    let other = ["make", "--plant", "thermal", "--cases", "5", "--seed", "12", "--out", "other"];
    fails(&mut challenge(here, &other), 1, "other-sealed");
    assert!(!here.join("other").exists(), "cases without labels");

    let submission = here.join("silent.json");
    fs::write(&submission, silent(&here.join("set"), 4).to_string()).unwrap();
    let score = ["score", "silent.json", "--set", "set"];
    fails(&mut challenge(here, &score), 1, "cases.case-004: it is missing");
    assert!(!here.join("spent_seeds.csv").exists(), "nothing was opened");
    let part = [&score[..], &["--first", "4"]].concat();
    runs(&mut challenge(here, &part));
    runs(&mut challenge(here, &part));
    let scored = json(&here.join("silent.score.json"));
    assert_eq!(scored["outcomes"].as_array().unwrap().len(), 4);
    let spent = fs::read_to_string(here.join("spent_seeds.csv")).unwrap();
    assert_eq!(spent.lines().count(), 2, "{spent}");
    fails(&mut challenge(here, &[&make[..7], &["--out", "again"]].concat()), 1, "have been opened");
    runs(&mut challenge(here, &["board", "silent.score.json", "--out", "board.html"]));
    let page = fs::read_to_string(here.join("board.html")).unwrap();
    assert!(page.contains("thermal, seed 11, 4 cases: "), "{page}");
}
