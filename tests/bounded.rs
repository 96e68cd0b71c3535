//! Work and memory of a command are bounded by what it reads.

use std::{fmt::Write as _, fs, path::Path, process::Command};

use crate::support::{Scratch, program};

/// A log of a muscle that goes up and down, and a gauge that follows it.
fn log(path: &Path, rows: u32, step_s: f64) {
    let mut text = String::from("time_s,length_mm,bridge_v\n");
    for n in 0..rows {
        let length = 165.0 + 14.0 * (0.01 * f64::from(n)).sin();
        let volts = 1.24 + 0.03 * (180.0 - length) + 1e-3 * f64::from(n % 101 * 41 % 101) / 101.0;
        let _ = writeln!(text, "{:e},{length:.3},{volts:.5}", f64::from(n) * step_s);
    }
    fs::write(path, text).unwrap();
}

/// Whether a command succeeds, and what it says on standard error.
fn told(scratch: &Scratch, arguments: &[&str]) -> (bool, String) {
    let mut program = Command::new(program());
    let out = program.current_dir(scratch.path("")).args(arguments).output().unwrap();
    (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
}

#[test]
fn times_that_nobody_means_are_refused() {
    let scratch = Scratch::new();
    log(&scratch.path("ps.csv"), 500, 1e-12);
    let (done, said) = told(&scratch, &["calibrate", "ps.csv", "--out", "cal.json"]);
    assert!(!done && said.contains("1.000e12 samples a second"), "{said}");
}

#[test]
fn a_data_set_that_says_another_rate_than_its_stamps_is_told_both() {
    let scratch = Scratch::new();
    fs::create_dir(scratch.path("set")).unwrap();
    log(&scratch.path("set/a.csv"), 1500, 0.01);
    let set =
        "name = 'set'\nrate_hz = 250\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'fit'\n";
    fs::write(scratch.path("set/dataset.toml"), set).unwrap();
    let (done, said) = told(&scratch, &["calibrate", "set", "--out", "cal.json"]);
    assert!(done && said.contains("rate_hz = 250") && said.contains("100.00 Hz"), "{said}");
}
