//! The page on the files that the program writes and reads. Its examples are real output of the
//! program.

use std::{fs, path::Path};

use serde_json::Value;

use super::reference::is_written_by_the_program;
use crate::support::{Scratch, calibrate, prints, runs, stretch};

const BEGIN: &str = "\
# Files

In addition to recordings, the program reads and writes the four kinds of files on this page. The examples are output of the program. An unknown key in a rig file, a problem file or a calibration file is an error, and the message names the key.

";

const DATA_SET: &str = "
## A data set: dataset.toml

A folder with `dataset.toml` and its trials is a data set; most commands accept the folder in place of files. A trial has a `kind` (`inflation`,
`deflation`, `arbitrary`, `pulses` or `other`) and a `split`: `fit` trials are fitted, `test` trials are held back. `start_s` is the time in the session at which a trial begins; drift effects need it. `stretch simulate` adds a
`digest` (checksum) of each trial's file, which is verified when the file is read. `rig` names the rig file of the simulator.

";

const RIG: &str = "
## A rig file

A rig file describes the built-in simulator: its parameters with their tolerances, and its effects. `stretch simulate --print-rig` prints the stock rig. A tolerance is one standard deviation; a parameter without a tolerance is exact. An effect that is switched on is a table `[[effect]]` with the name and the parameters that `stretch effects` lists. `stretch diagnose --fix` writes a rig file with the re-tuned parameters and the named effects.

";

const PROBLEM: &str = "
## Your own simulator: problem.toml

A problem file describes a simulator of your own and its recordings. `stretch init FOLDER` writes a first version of the file into a folder with recordings. [The tutorial](../tutorials/worker.md) shows how to complete it, and [the worker protocol](worker.md) specifies what the simulator's `command` must answer. The command runs with your rights.

";

const RECORD: &str = "
## A calibration file

`stretch calibrate --out cal.json` writes a calibration file in JSON. If the file name ends with `.postcard`, it writes a binary calibration file for a board. `stretch export --calibration cal.json` checks the digest in the file. After a change by hand, the option `--seal` renews the digest.

| key | what |
| --- | --- |
| `schema` | version of the format; a newer version is refused before anything else is read |
| `signal`, `reference` | columns of the recording; the unit is the last part of the name |
| `sample_rate_hz` | rate at which the calibration runs |
| `target` | quantity that the model estimates: the reference itself (`direct`), or a contraction, with its resting length |
| `polarity` | whether the signal rises or falls as the target rises |
| `signal_range`, `target_range` | smallest and largest value in the fitted trials; signal and target are divided by these ranges |
| `rate_estimator` | window and degree of the Savitzky-Golay filter that gives the rate |
| `rate_source` | whether the fit used the rate of the signal or, as published, the rate of the reference |
| `turns` | levels of the turning points of movements in the fitted trials, and the limit for their change across a pause; absent if there were too few movements |
| `dead_band` | rate below which the direction of motion is not changed, in units of the signal per second |
| `model` | name of the model, with its coefficients, time constants and domains |
| `provenance` | date of the calibration; number, names and checksums of the fitted trials |
| `digest` | checksum of all other keys |
";

/// Returns the first lines of a text, followed by an ellipsis.
fn first(text: &str, lines: usize) -> String {
    let shown: Vec<&str> = text.lines().take(lines).map(str::trim_end).collect();
    format!("{}\n...\n", shown.join("\n").trim_end())
}

fn toml(text: &str) -> String {
    format!("```toml\n{}\n```\n", text.trim())
}

/// Removes the digests of recordings, which change with the last bit of the simulation.
fn without_digests(text: &str) -> String {
    let kept = text.lines().filter(|line| !line.starts_with("digest"));
    kept.map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_files_are_such_as_the_program_writes() {
    let scratch = Scratch::new();
    let bench = scratch.path("bench");
    runs(stretch().args(["simulate", "--protocol", "pulses", "--out"]).arg(&bench));
    let set = fs::read_to_string(bench.join("dataset.toml")).expect("a data set");
    let rig = prints(stretch().args(["simulate", "--print-rig"]));
    let folder = scratch.path("servo");
    fs::create_dir(&folder).expect("a folder");
    let row = |n: u32| format!("{:.2},{},{}\n", 0.01 * f64::from(n), n / 50, n / 2);
    let rows: String = (0..2000).map(row).collect();
    for name in ["monday.csv", "tuesday.csv"] {
        fs::write(folder.join(name), format!("time_s,command_V,angle_deg\n{rows}")).expect("a log");
    }
    runs(stretch().arg("init").arg(&folder));
    let problem = fs::read_to_string(folder.join("problem.toml")).expect("a problem");
    let text = [
        BEGIN.trim_end(),
        "\n",
        DATA_SET,
        &toml(&first(&without_digests(&set), 16)),
        RIG,
        &toml(&first(&rig, 16)),
        PROBLEM,
        &toml(&problem),
        RECORD,
    ];
    is_written_by_the_program("files.md", &text.concat());
}

#[test]
fn every_key_of_a_record_stands_on_the_page() {
    let scratch = Scratch::new();
    let log = scratch.loops("log.csv", 30.0, 1.1);
    let record = scratch.path("cal.json");
    runs(&mut calibrate(&log, Path::new(&record)));
    let text = fs::read_to_string(&record).expect("a record");
    let keys: Value = serde_json::from_str(&text).expect("JSON");
    let keys: Vec<&String> = keys.as_object().expect("an object").keys().collect();
    assert!(keys.len() > 10, "{keys:?}");
    let rows: String = RECORD.lines().filter_map(|line| line.split(" | ").next()).collect();
    for key in keys {
        assert!(rows.contains(&format!("`{key}`")), "{key}");
    }
}
