//! Commands that write, their inputs, and the files afterwards.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Stdio},
};

use stretch_calibrate::calibration_to_json;
use stretch_receptor::example_calibration;

use super::Scratch;

/// Returns every file below a folder, except those with a temporary name.
pub(crate) fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with(".stretch-") {
            continue;
        }
        if entry.path().is_dir() {
            let below = tree(&entry.path()).into_iter();
            files.extend(below.map(|(path, bytes)| (format!("{name}/{path}"), bytes)));
        } else {
            files.insert(name, fs::read(entry.path()).unwrap());
        }
    }
    files
}

/// Creates the inputs of all commands, and the files that they replace.
pub(crate) fn prepared() -> Scratch {
    let scratch = Scratch::in_memory();
    scratch.loops("a.csv", 20.0, 1.1);
    scratch.calibration("cal.json");
    scratch.write("board.json", calibration_to_json(&example_calibration()).unwrap());
    for name in ["cal.html", "cal.postcard", "d.json", "d.html", "fixed.toml", "out.csv"] {
        scratch.write(name, format!("an old {name}"));
    }
    fs::create_dir(scratch.path("logs")).unwrap();
    fs::copy(scratch.path("a.csv"), scratch.path("logs/a.csv")).unwrap();
    scratch.write("logs/problem.toml", "an old one");
    let mut simulate = command(&scratch, "simulate --protocol arbitrary --out bench");
    assert!(simulate.status().unwrap().success());
    fs::create_dir(scratch.path("bench/own")).unwrap();
    scratch.write("bench/own/notes.txt", "mine");
    scratch.write("bench/report.html", "mine");
    scratch
}

pub(crate) fn command(scratch: &Scratch, line: &str) -> Command {
    let mut command = Command::new(super::program());
    command.current_dir(scratch.path("")).args(line.split(' '));
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Whether a process has begun to write next to a target.
pub(crate) fn writes(folder: &Path) -> bool {
    let is_temporary =
        |entry: fs::DirEntry| entry.file_name().to_string_lossy().starts_with(".stretch-");
    let here = fs::read_dir(folder).is_ok_and(|mut all| all.any(|e| e.is_ok_and(is_temporary)));
    here || fs::read_dir(folder.join("logs"))
        .is_ok_and(|mut all| all.any(|e| e.is_ok_and(is_temporary)))
}
