//! Shared code of the program's tests: a scratch folder, trials, runs of the program.

pub(crate) mod packed;
pub(crate) mod round_trip;
pub(crate) mod written;

use std::{
    fmt::Write,
    path::{Path, PathBuf},
    process::Output,
};

use assert_cmd::Command;
use tempfile::TempDir;

/// Returns the path of the program: `STRETCH_PROGRAM`, otherwise the one built with the tests.
/// `./ci.sh` runs the slow tests with a release build.
pub(crate) fn program() -> PathBuf {
    std::env::var_os("STRETCH_PROGRAM")
        .map_or_else(|| env!("CARGO_BIN_EXE_stretch").into(), PathBuf::from)
}

/// Returns a command that runs the program.
pub(crate) fn stretch() -> Command {
    Command::new(program())
}

/// A temporary folder that is removed at the end of the test.
pub(crate) struct Scratch(TempDir);

impl Scratch {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// Creates the folder in memory if possible, because syncing takes no time there.
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

    /// Returns the sorted names of everything in the folder.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("the scratch folder");
        let mut names: Vec<String> =
            entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// Writes a trial of a muscle that shortens and lengthens, with a lagging gauge.
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

    /// Writes a calibration fitted to such a trial.
    pub(crate) fn calibration(&self, name: &str) -> PathBuf {
        let trial = self.loops("for_calibration.csv", 40.0, 1.1);
        let out = self.path(name);
        stretch().arg("calibrate").arg(&trial).arg("--out").arg(&out).assert().success();
        out
    }
}

/// Returns standard output as text.
pub(crate) fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

/// Joins lines that were wrapped at 100 columns: a line is continued if it had no room for the
/// first word of the next line.
pub(crate) fn unbroken(text: &str) -> String {
    let mut told = String::new();
    let mut room = 100;
    for line in text.split_inclusive('\n') {
        let word = line.split_whitespace().next().unwrap_or("").chars().count();
        if room < word + 1 && word > 0 {
            told.truncate(told.trim_end().len());
            told.push(' ');
            told.push_str(line.trim_start());
        } else {
            told.push_str(line);
        }
        let own = line.trim_end_matches('\n').chars().count();
        room = if line.starts_with('|') { 100 } else { 100_usize.saturating_sub(own) };
    }
    told
}

/// Runs a command that must succeed. Returns its output with each sentence in one line.
#[track_caller]
pub(crate) fn runs(command: &mut Command) -> String {
    unbroken(&prints(command))
}

/// Runs a command that must succeed. Returns its messages on standard error in one line.
#[track_caller]
pub(crate) fn warned(command: &mut Command) -> String {
    let output = command.output().expect("the program runs");
    let told = one_line(&String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{told}");
    told
}

/// Runs a command that must succeed. Returns its output unchanged.
#[track_caller]
pub(crate) fn prints(command: &mut Command) -> String {
    let output = command.output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    stdout(&output)
}

/// Returns the option that writes JSON into a file.
pub(crate) fn json_to(file: &Path) -> String {
    format!("--json={}", file.display())
}

/// Joins a text to one line, because line breaks depend on the width of the terminal.
pub(crate) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Runs a command that must fail with exit code 1 and a message that contains all of `parts`.
#[track_caller]
pub(crate) fn fails(command: &mut Command, parts: &[&str]) {
    let output = command.output().expect("the program runs");
    let message = one_line(&String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(!message.contains("panicked"), "{message}");
    for part in parts {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
}

/// Returns the command `calibrate` on a file.
pub(crate) fn calibrate(trial: &Path, out: &Path) -> Command {
    let mut command = stretch();
    command.arg("calibrate").arg(trial).arg("--out").arg(out);
    command
}
