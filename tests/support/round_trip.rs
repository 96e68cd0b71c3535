//! Diagnosing, writing the corrected rig file, and replaying it.

use std::{fs, path::Path};

use serde_json::Value;

use super::{Scratch, json_to, runs, stretch};

/// Diagnoses with a rig file, or with the data set's own. If `fix` is given, writes the corrected
/// rig file.
pub(crate) fn diagnosed(
    scratch: &Scratch,
    folder: &Path,
    rig: Option<&Path>,
    fix: Option<&Path>,
) -> Value {
    let json = scratch.path("round_trip.json");
    let mut command = stretch();
    command.arg("diagnose").arg(folder).arg("--no-next").arg(json_to(&json));
    for (option, path) in [("--rig", rig), ("--fix", fix)] {
        if let Some(path) = path {
            command.arg(option).arg(path);
        }
    }
    runs(&mut command);
    serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap()
}

/// Whether a diagnosis finds nothing to add to the simulator.
pub(crate) fn is_agreed(diagnosis: &Value) -> bool {
    matches!(diagnosis["verdict"].as_str(), Some("no_gap" | "parameters"))
}

/// Returns for each column the root mean square distance of a replay with a rig file from the
/// measurement, relative to the noise of the stock rig.
///
/// `commands` is a trial, or a folder with trials of the same names.
pub(crate) fn replayed(
    scratch: &Scratch,
    rig: &Path,
    commands: &Path,
    measured: &Path,
) -> Vec<(String, f64)> {
    let out = scratch.path("replayed");
    let mut command = stretch();
    command.args(["simulate", "--noise", "off", "--force", "--rig"]).arg(rig);
    runs(command.arg("--protocol").arg(commands).arg("--out").arg(&out));
    // Noise of the stock rig, including the rounding of its converters.
    let noises = [("pressure_kpa", 1.2), ("length_mm", 0.0502), ("bridge_v", 0.00202)];
    let mut sums = [(0.0, 0.0); 3];
    for entry in fs::read_dir(&out).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "csv") {
            continue;
        }
        let there = measured.join(path.file_name().unwrap());
        for ((column, noise), sum) in noises.iter().zip(&mut sums) {
            let (own, other) = (read(&path, column), read(&there, column));
            for (a, b) in own.iter().zip(&other) {
                sum.0 += ((a - b) / noise).powi(2);
                sum.1 += 1.0;
            }
        }
    }
    fs::remove_dir_all(&out).unwrap();
    let seen = noises.iter().zip(sums).filter(|(_, sum)| sum.1 > 0.0);
    seen.map(|((column, _), (sum, count))| ((*column).to_owned(), (sum / count).sqrt())).collect()
}

/// Reads a column of a trial. Returns an empty list if the column does not exist.
fn read(path: &Path, column: &str) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let Some(at) = lines.next().unwrap().split(',').position(|c| c == column) else {
        return Vec::new();
    };
    lines.map(|line| line.split(',').nth(at).unwrap().parse().unwrap()).collect()
}
