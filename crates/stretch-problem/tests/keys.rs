//! Keys of a problem's file that recordings at slow rates and with times in other units ask for.

use std::fmt::Write;

use stretch_problem::{Checked, ProblemFile};

/// A file whose times count milliseconds without saying so, two samples a second, fifteen seconds a trial.
fn file(unit: &str) -> (tempfile::TempDir, Result<ProblemFile, String>) {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a.csv", "b.csv"] {
        let mut rows = "clock,pump_V,level_cm\n".to_owned();
        for i in 0..30 {
            let level = (0.3 * f64::from(i)).sin() + if name == "a.csv" { 0.0 } else { 0.5 };
            writeln!(rows, "{},{},{level}", 500 * i, i % 7).expect("a text");
        }
        std::fs::write(folder.path().join(name), rows).expect("a file");
    }
    let text = format!(
        "simulator = [\"none\"]\ntime = \"clock\"\n{unit}\n[[stage]]\noutput = \"level_cm\"\ninputs = [\"pump_V\"]\n\
         [[trial]]\nfile = \"a.csv\"\n[[trial]]\nfile = \"b.csv\"\nsplit = \"test\"\n"
    );
    let path = folder.path().join("problem.toml");
    std::fs::write(&path, text).expect("a file");
    (folder, ProblemFile::read(path).map_err(|e| e.to_string()))
}

#[test]
fn times_count_what_the_file_says_and_short_trials_at_slow_rates_are_kept() {
    let (_folder, file) = file("time_unit = \"ms\"");
    let file = file.expect("a problem's file");
    let problem = Checked::new(file.load().expect("recordings")).expect("a problem");
    assert!((problem.session().dt_s - 0.5).abs() < 1e-12);
    let samples: Vec<usize> = problem.session().trials.iter().map(|t| t.samples.len()).collect();
    assert_eq!(samples, [30, 30]);
    let again = ProblemFile::parse("problem.toml", &file.to_toml()).expect("the same");
    assert_eq!(again.time_unit, file.time_unit);
}

#[test]
fn a_unit_that_is_none_is_refused_with_those_that_are() {
    let (_folder, file) = file("time_unit = \"min\"");
    let error = file.expect_err("no unit");
    assert!(error.ends_with("key time_unit: \"min\" is none of s, ms, us, ns"), "{error}");
}

#[test]
fn the_schema_has_every_key_that_the_reader_takes() {
    let schema = stretch_problem::problem_schema();
    let text = "simulator = [\"none\"]\n[[stage]]\noutput = \"y\"\n[[trial]]\nfile = \"a.csv\"\n";
    assert!(ProblemFile::parse("p.toml", text).is_ok());
    // A key of the schema is read: it fails by its value, not because nothing reads it.
    let tables = [("stage", "[[stage]]"), ("trial", "[[trial]]"), ("input", "[[input]]")];
    for (table, head) in tables.into_iter().chain([("parameter", "[[parameter]]")]) {
        let keys = schema["$defs"][table]["properties"].as_object().expect("keys");
        assert!(keys.len() > 2, "{table}");
        for key in keys.keys() {
            let text = format!("{text}{head}\n{key} = {{}}\n");
            let error = ProblemFile::parse("p.toml", &text).expect_err("a wrong value").to_string();
            assert!(!error.contains("nothing reads it"), "{table}.{key}: {error}");
        }
    }
    for key in schema["properties"].as_object().expect("keys").keys() {
        let error = ProblemFile::parse("p.toml", &format!("{key} = {{}}\n")).map(|_| ());
        let error = error.expect_err("a wrong value").to_string();
        assert!(!error.contains("nothing reads it"), "{key}: {error}");
    }
}
