//! What a kill leaves is whole, and what is done is not done again.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use crate::support::{PROGRAM, bytes, file, only, said, trial};

/// Starts the program, kills it once `is_reached`, and says whether it was still running then.
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

/// Whether two lakes have the same files of trials, to the bit.
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
        // no two files have the same bytes: they would be the same trial
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

/// A kill between a trial's last byte and its name leaves a temporary file that is whole.
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
            "6 records of 6 sensors, 0 refused; {computed} months of rigs computed now"
        )),
        "{told}"
    );
    assert!(fs::read(only(&states)).unwrap() == before, "what was done was done again");
    // the same as without a kill, to the bit: states are merged in the order of their days
    fs::remove_dir_all(&states).unwrap();
    said("calibrate --lake {} --out {} --threads 1", &[&lake, &fresh]);
    assert_eq!(bytes(&fresh).len(), bytes(&out).len());
    // a day more makes its month anew, and no other
    let told = said("make --lake {} --sensors 6 --days 63 --rows 200 --rigs 3", &[&lake]);
    assert!(told.contains("1200 rows written"), "{told}");
    let told = said("calibrate --lake {} --out {}", &[&lake, &out]);
    assert!(told.contains("3 months of rigs computed now"), "{told}");
}
