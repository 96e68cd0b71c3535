//! What the tests of the program share: a scratch folder, trials, running.
#![allow(dead_code)] // each test file uses its part

pub(crate) mod round_trip;
pub(crate) mod written;

use std::{
    fmt::Write,
    path::{Path, PathBuf},
    process::Output,
};

use assert_cmd::Command;
use tempfile::TempDir;

/// The program.
pub(crate) fn stretch() -> Command {
    Command::new(env!("CARGO_BIN_EXE_stretch"))
}

/// A folder that goes with the test.
pub(crate) struct Scratch(TempDir);

impl Scratch {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// One where syncing takes no time, if there is such a place.
    pub(crate) fn in_memory() -> Self {
        match tempfile::tempdir_in("/dev/shm") {
            Ok(folder) => Self(folder),
            Err(_) => Self::new(),
        }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, text).expect("a scratch file");
        path
    }

    /// Everything in the folder.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("the scratch folder");
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// A trial of a muscle that shortens and lengthens, with a lagging gauge.
    pub(crate) fn loops(&self, name: &str, seconds: f64, speed: f64) -> PathBuf {
        let mut text = String::from("time_s,length_mm,bridge_v\n");
        for n in 0..(seconds * 100.0) as u32 {
            let t = f64::from(n) * 0.01;
            let length = |t: f64| 165.0 + 14.0 * (speed * t).cos() * (0.31 * t).cos();
            let volts = 1.24 + 0.033 * (180.0 - length(t - 0.03));
            writeln!(text, "{t:.2},{:.4},{volts:.5}", length(t)).unwrap();
        }
        self.write(name, text)
    }

    /// A calibration fitted to such a trial.
    pub(crate) fn calibration(&self, name: &str) -> PathBuf {
        let trial = self.loops("for_calibration.csv", 40.0, 1.1);
        let out = self.path(name);
        stretch().arg("calibrate").arg(&trial).arg("--out").arg(&out).assert().success();
        out
    }
}

/// Standard output as text.
pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

/// What a command says that succeeds.
#[track_caller]
pub(crate) fn runs(command: &mut Command) -> String {
    let output = command.output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    stdout(&output)
}

/// Runs to a failure with exit code 1 and a message that has all of `parts`.
#[track_caller]
pub(crate) fn fails(command: &mut Command, parts: &[&str]) {
    let output = command.output().expect("the program runs");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(!message.contains("panicked"), "{message}");
    for part in parts {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
}

/// `calibrate` on a file.
pub(crate) fn calibrate(trial: &Path, out: &Path) -> Command {
    let mut command = stretch();
    command.arg("calibrate").arg(trial).arg("--out").arg(out);
    command
}
