//! Writes each case into a folder, and seals the labels.

use std::{
    fmt::Write as _,
    fs,
    path::Path,
    sync::atomic::{AtomicUsize, Ordering},
};

use rayon::prelude::*;

use crate::case::{Case, Recording};
use crate::error::BlindError;
use crate::plan::Plan;
use crate::protocol::{RATE_HZ, Split};
use crate::seal::MARK;
use crate::truth::Truth;

/// Makes the cases of a plan under `dir` and seals their labels.
///
/// Writes `case-000/`, `case-001/`, ..., `sealed/truth.json` and `seal.sha256`. Each case is a data
/// set: `dataset.toml` and seventeen trials. There is also `rig.toml` if a rig file
/// states the noise, and `hint.toml` with `without = ["name"]` if an entry is removed from the
/// catalogue. The same seed and plan give the same bytes, whatever the number of threads.
/// `progress` is called with the number of finished cases, possibly from several threads.
///
/// Publish the returned SHA-256 before any diagnosis runs.
///
/// # Errors
/// [`BlindError::Occupied`] when `dir` holds a seal already; [`BlindError::Io`] when a file
/// cannot be written; [`BlindError::NoRig`] when no rig fits a case.
///
/// ```
/// let dir = tempfile::tempdir()?;
/// let plan = stretch_blind::Plan { null: 1, ..stretch_blind::Plan::of(0) };
/// let sha256 = stretch_blind::make(dir.path(), 7, &plan, &|_| {})?;
/// assert_eq!(sha256.len(), 64);
/// assert!(dir.path().join("case-000/pulses_2.csv").exists());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn make(
    dir: &Path,
    seed: u64,
    plan: &Plan,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<String, BlindError> {
    if dir.join(MARK).exists() || dir.join("sealed").exists() {
        return Err(BlindError::Occupied { path: dir.to_path_buf() });
    }
    let done = AtomicUsize::new(0);
    let orders = plan.orders(seed);
    let labels: Result<Vec<_>, BlindError> = orders
        .par_iter()
        .enumerate()
        .map(|(number, &order)| {
            let name = format!("case-{number:03}");
            let case = Case::make(number, seed, plan, order)?;
            write_case(&dir.join(&name), &name, &case)?;
            progress(done.fetch_add(1, Ordering::Relaxed) + 1);
            Ok((name, case.label))
        })
        .collect();
    let truth = Truth { schema: 1, seed: Some(seed), cases: labels?.into_iter().collect() };
    truth.seal(dir)
}

/// Writes a text file, and creates its parent folders.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), BlindError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(BlindError::io(folder))?;
    }
    fs::write(path, text).map_err(BlindError::io(path))
}

fn write_case(folder: &Path, name: &str, case: &Case) -> Result<(), BlindError> {
    let write = |file: &str, text: &str| write(&folder.join(file), text);
    let mut index = format!("name = \"{name}\"\nrate_hz = {RATE_HZ}.0\n");
    if let Some([pressure, length, volts]) = case.noise {
        index.push_str("rig = \"rig.toml\"\n");
        write(
            "rig.toml",
            &format!(
                "[pneumatics]\nsigma_p = {{ value = {pressure:?} }}\n\n\
                 [sensing]\nsigma_v = {{ value = {volts:?} }}\n\n\
                 [reference]\nsigma_L = {{ value = {length:?} }}\n"
            ),
        )?;
    }
    for recording in &case.recordings {
        let script = &recording.script;
        let _ =
            write!(index, "\n[[trial]]\nfile = \"{}\"\nkind = \"{}\"\n", script.file, script.kind);
        if let Some(opening) = script.opening {
            let _ = writeln!(index, "opening = {opening:?}");
        }
        let split = if script.split == Split::Fit { "fit" } else { "test" };
        let _ = writeln!(index, "start_s = {:?}\nsplit = \"{split}\"", script.start_s);
        write(&script.file, &csv(recording))?;
    }
    write("dataset.toml", &index)?;
    match &case.label.struck {
        Some(struck) => write("hint.toml", &format!("without = [\"{struck}\"]\n")),
        None => Ok(()),
    }
}

fn csv(recording: &Recording) -> String {
    let mut text = String::with_capacity(40 * recording.length_mm.len());
    text.push_str("time_s,inlet,outlet,");
    text.push_str(if recording.pressure_kpa.is_some() { "pressure_kpa," } else { "" });
    text.push_str("length_mm,bridge_v\n");
    for (i, (inlet, outlet)) in recording.script.openings.iter().enumerate() {
        if recording.missing.get(i) == Some(&true) {
            continue;
        }
        let _ = match &recording.stamps {
            Some(stamps) => write!(text, "{:.6},{inlet},{outlet},", stamps[i]),
            None => write!(text, "{:.2},{inlet},{outlet},", i as f64 / RATE_HZ as f64),
        };
        if let Some(pressure) = &recording.pressure_kpa {
            let _ = write!(text, "{:.1},", pressure[i]);
        }
        let _ = writeln!(text, "{:.3},{:.4}", recording.length_mm[i], recording.bridge_v[i]);
    }
    text
}
