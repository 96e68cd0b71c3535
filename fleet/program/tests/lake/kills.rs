//! After a kill every file is complete, and finished work is not repeated.

use std::{
    fs,
    io::{BufRead, BufReader},
    path::Path,
    process::{Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use crate::{
    jobs::{CALIBRATE, DIAGNOSE, DRIFT, INGEST, MAKE, RECORDS},
    support::{PROGRAM, bytes, file, fleet, only, said, tree, trial},
};

/// Starts the program and kills it once `is_reached`. Returns whether it was still running.
fn killed(words: &[&str], is_reached: impl Fn() -> bool) -> bool {
    let mut child = Command::new(PROGRAM)
        .args(words)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs");
    let begun = Instant::now();
    while !is_reached() && begun.elapsed() < Duration::from_secs(120) {
        if child.try_wait().expect("it can be asked").is_some() {
            return false;
        }
        sleep(Duration::from_millis(2));
    }
    child.kill().expect("it can be killed");
    child.wait().expect("it ends");
    true
}

fn count(folder: &Path) -> usize {
    let is_parquet = |path: &Path| path.extension().is_some_and(|ending| ending == "parquet");
    bytes(folder).iter().filter(|(path, _)| is_parquet(path)).count()
}

/// Whether two lakes have the same trial files, bit for bit.
fn same_trials(a: &Path, b: &Path) -> bool {
    let relative = |lake: &Path| -> Vec<_> {
        let all = bytes(&lake.join("trials")).into_iter();
        let whole =
            all.filter(|(path, _)| path.extension().is_some_and(|ending| ending == "parquet"));
        whole.map(|(path, bytes)| (path.strip_prefix(lake).unwrap().to_owned(), bytes)).collect()
    };
    relative(a) == relative(b)
}

#[test]
fn a_lake_that_was_killed_is_made_to_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let [killed_lake, whole] = ["killed", "whole"].map(|name| folder.path().join(name));
    let shown = killed_lake.display().to_string();
    let words = ["make", "--lake", &shown, "--sensors", "6", "--days", "20", "--rows", "300"];
    assert!(
        killed(&words, || count(&killed_lake.join("trials")) >= 5),
        "it was too fast to be killed"
    );
    let left = count(&killed_lake.join("trials"));
    said("make --lake {} --sensors 6 --days 20 --rows 300", &[&killed_lake]);
    said("make --lake {} --sensors 6 --days 20 --rows 300", &[&whole]);
    assert!((5..120).contains(&left) && count(&killed_lake.join("trials")) == 120);
    assert!(same_trials(&killed_lake, &whole), "a killed lake is another");
}

#[test]
fn what_an_ingest_wrote_before_it_was_killed_stays() {
    let folder = tempfile::tempdir().unwrap();
    let [logs, killed_lake, whole] =
        ["logs", "killed", "whole"].map(|name| folder.path().join(name));
    let mut one = trial("", 0.0);
    for k in 0..300 {
        one.name = format!("ulm/r2/{:04}/20260103_a.csv", k);
        // All files have different bytes, because files with equal bytes would be the same trial.
        one.channels[1].values[0] = 1.24 + 1e-6 * f64::from(k);
        file(&logs, &one);
    }
    let from_path = "{site}/{rig}/{sensor}/{date}_*.csv";
    let [shown, to] = [&logs, &killed_lake].map(|path| path.display().to_string());
    let words = ["ingest", &shown, "--lake", &to, "--from-path", from_path];
    let trials = killed_lake.join("trials");
    assert!(killed(&words, || count(&trials) >= 5), "it was too fast to be killed");
    let left = count(&trials);
    let before = fs::read(only(&trials)).unwrap();
    let line = "ingest {} --lake {} --from-path {site}/{rig}/{sensor}/{date}_*.csv";
    let told = said(line, &[&logs, &killed_lake]);
    let missing = 300 - left;
    assert!(told.contains(&format!("{missing} trials written")), "{left} were there: {told}");
    assert!(told.contains(&format!("{left} there already, 0 refused")), "{told}");
    assert!(fs::read(only(&trials)).unwrap() == before, "what was done was done again");
    said(line, &[&logs, &whole]);
    assert!(same_trials(&killed_lake, &whole), "a killed lake is another");
}

/// A kill after a trial was written and before it was renamed leaves a complete temporary file.
#[test]
fn a_trial_that_was_killed_before_it_had_its_name_is_ingested() {
    let folder = tempfile::tempdir().unwrap();
    let [logs, lake] = ["logs", "lake"].map(|name| folder.path().join(name));
    file(&logs, &trial("ulm/r2/0001/20260103_a.csv", 0.0));
    let line = "ingest {} --lake {} --from-path {site}/{rig}/{sensor}/{date}_*.csv";
    said(line, &[&logs, &lake]);
    let named = only(&lake.join("trials"));
    fs::rename(&named, named.with_file_name(".stretch-AbCdEf.tmp")).unwrap();
    let told = said(line, &[&logs, &lake]);
    assert!(told.contains("1 trials written") && told.contains("0 refused"), "{told}");
    assert!(named.exists());
}

#[test]
fn calibrations_go_on_where_they_were_killed() {
    let folder = tempfile::tempdir().unwrap();
    let [lake, out, fresh] = ["lake", "out", "fresh"].map(|name| folder.path().join(name));
    said("make --lake {} --sensors 6 --days 62 --rows 200 --rigs 3", &[&lake]);
    let (shown, target) = (lake.display().to_string(), out.display().to_string());
    let words = ["calibrate", "--lake", &shown, "--out", &target];
    let states = lake.join("states");
    assert!(killed(&words, || count(&states) >= 1), "it was too fast to be killed");
    let left = count(&states);
    assert!((1..9).contains(&left), "{left} of 9 months of rigs");
    let before = fs::read(only(&states)).unwrap();
    let told = said("calibrate --lake {} --out {}", &[&lake, &out]);
    let computed = 9 - left;
    assert!(
        told.contains(&format!(
            "6 calibrations of 6 sensors, 0 refused; {computed} months of rigs computed now"
        )),
        "{told}"
    );
    assert!(fs::read(only(&states)).unwrap() == before, "what was done was done again");
    // The result has the same bits as without a kill, because states are merged in the order of
    // their days.
    fs::remove_dir_all(&states).unwrap();
    said("calibrate --lake {} --out {} --threads 1", &[&lake, &fresh]);
    assert!(tree(&fresh) == tree(&out), "a killed calibration is another");
    // An additional day causes only its month to be computed again.
    let told = said("make --lake {} --sensors 6 --days 63 --rows 200 --rigs 3", &[&lake]);
    assert!(told.contains("1200 rows written"), "{told}");
    let told = said("calibrate --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("3 months of rigs computed now"), "{told}");
}

#[test]
fn an_ingest_killed_before_any_call_is_mended_by_the_next() {
    let calls = INGEST.is_killed_before_its_calls(3);
    assert!(calls > 20, "{calls}");
}

#[test]
fn a_calibration_killed_before_any_call_is_mended_by_the_next() {
    let calls = CALIBRATE.is_killed_before_its_calls(6);
    assert!(calls > 20, "{calls}");
}

/// The table of `drift` is outside the lake, where the lake's lock does not protect it against
/// other commands.
#[test]
fn a_drift_killed_before_any_call_is_mended_by_the_next() {
    let calls = DRIFT.is_killed_before_its_calls(2);
    assert!(calls > 10, "{calls}");
}

/// Verdicts and calibration files are outside the lake, too. The lake made by `make` is killed
/// before it is complete.
#[test]
fn what_else_writes_killed_before_any_call_is_mended_by_the_next() {
    for (job, step, least) in [(MAKE, 4, 20), (DIAGNOSE, 3, 15), (RECORDS, 2, 10)] {
        let calls = job.is_killed_before_its_calls(step);
        assert!(calls > least, "{calls}");
    }
}

#[test]
#[ignore = "a minute of kills; gate.sh runs it"]
fn every_call_of_every_command_that_writes_may_be_the_last() {
    let jobs = [INGEST, CALIBRATE, DRIFT, MAKE, DIAGNOSE, RECORDS];
    let calls = jobs.map(|job| job.is_killed_before_its_calls(1));
    println!("{calls:?} kills, all mended");
}

#[test]
#[ignore = "a minute of kills; gate.sh runs it"]
fn thirty_kills_of_an_ingest_and_of_a_calibration_are_mended() {
    let tried = [INGEST, CALIBRATE].map(|job| job.is_killed_at_moments(30));
    println!("{tried:?} kills, 30 of them before the end, all mended");
}

/// The lock of a lake ends with the process that holds it.
#[test]
fn the_lock_of_a_dead_command_is_nobodys() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path().join("lake");
    let path = file(folder.path(), &trial("1.csv", 0.0));
    said("ingest {} --lake {} --sensor 1 --date 2026-01-01", &[&path, &lake]);
    let left = lake.join("trials/.stretch-AbCdEf.tmp");
    fs::write(&left, "half a trial").unwrap();
    let held = fs::File::open(lake.join(".stretch-lock")).unwrap();
    held.lock().unwrap();
    let line = format!("sql --lake {} --csv --threads 1", lake.display());
    let mut words: Vec<&str> = line.split(' ').collect();
    words.push("select count(*) from trials");
    let answer = Command::new(PROGRAM).args(words).output().unwrap();
    assert!(
        answer.status.success() && left.exists(),
        "a question waits for nobody, and clears up nothing"
    );
    let shown = lake.display().to_string();
    let words = ["make", "--lake", &shown, "--sensors", "1", "--days", "1", "--rows", "100"];
    let mut waits = Command::new(PROGRAM).args(words).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = String::new();
    BufReader::new(waits.stderr.take().unwrap()).read_line(&mut told).unwrap();
    assert!(
        told.contains("another command is writing into this folder") && left.exists(),
        "{told}"
    );
    drop(held);
    assert!(waits.wait().unwrap().success());
    assert!(!left.exists() && fleet("sql --lake {} x", &[&lake]).status.code() == Some(1));
}
