//! Data sets that were written are read back unchanged, and files of two data sets are not mixed.

use std::{fs, path::Path};

use stretch_data::files::write_folder;
use stretch_data::{Channel, DataError, DataSet, Split, Trial, TrialEntry, TrialKind};
use stretch_recording::{ReadOptions, Recording, RecordingError};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn load(entry: &TrialEntry, folder: &Path) -> Result<Recording, RecordingError> {
    Recording::of_entry(entry, folder, &ReadOptions::new())
}

#[test]
fn a_data_set_comes_back() {
    let parent = tempfile::tempdir().expect("a folder");
    let out = parent.path().join("set");
    let entry = |file: &str, split| TrialEntry {
        file: file.to_owned(),
        kind: TrialKind::Other,
        opening: None,
        start_s: 2.5,
        split,
        digest: None,
    };
    let set = DataSet {
        name: "bench \"07\"".to_owned(),
        rate_hz: 100.0,
        rig: None,
        trials: vec![entry("a.csv", Split::Fit), entry("b.csv", Split::Test)],
    };
    let trial = |entry: &TrialEntry| -> Result<Trial, DataError> {
        let channel = Channel { name: "length_mm".to_owned(), values: vec![180.0, 0.1 + 0.2] };
        Ok(Trial { name: entry.file.clone(), time_s: vec![0.0, 0.01], channels: vec![channel] })
    };
    set.write_folder(&out, false, None, trial).expect("written");
    assert_eq!(DataSet::read(&out).expect("read"), set);
    for split in [Split::Fit, Split::Test] {
        for entry in set.entries(split) {
            let back = load(entry, &out).expect("read").trial;
            assert_eq!(back, trial(entry).expect("made"));
        }
    }
    let spoilt = Trial { time_s: vec![0.0, f64::NAN], ..trial(&set.trials[0]).expect("made") };
    let error = set.write_folder(&out, true, None, |_| Ok::<_, DataError>(spoilt.clone()));
    assert_eq!(
        error.expect_err("not finite").to_string(),
        "a.csv, row 3, column time_s: \"NaN\" is not a finite number; correct it or remove that row"
    );
    assert_eq!(DataSet::read(&out).expect("still there"), set);
}

#[test]
fn what_is_the_users_comes_along_and_what_the_last_data_set_was_goes() {
    let parent = tempfile::tempdir().expect("a folder");
    let out = parent.path().join("set");
    let entry = |file: &str| TrialEntry {
        file: file.to_owned(),
        kind: TrialKind::Other,
        opening: None,
        start_s: 0.0,
        split: Split::Fit,
        digest: None,
    };
    let write = |files: &[&str], length_mm: f64| {
        let mut set = DataSet {
            name: "bench".to_owned(),
            rate_hz: 100.0,
            rig: None,
            trials: files.iter().map(|file| entry(file)).collect(),
        };
        write_folder(&out, true, |folder| {
            for file in files {
                let channel =
                    Channel { name: "length_mm".to_owned(), values: vec![length_mm, 181.0] };
                let time_s = vec![0.0, 0.01];
                Trial { name: (*file).to_owned(), time_s, channels: vec![channel] }
                    .write(folder.join(file))?;
            }
            set.take_digests(folder)?;
            set.write(folder)
        })
    };
    write(&["a.csv", "b.csv", "c.csv"], 180.0).expect("written");
    fs::write(out.join("b.csv"), "edited by hand").expect("written");
    fs::create_dir_all(out.join("own/deep")).expect("made");
    fs::write(out.join("own/deep/notes.txt"), "mine").expect("written");
    write(&["a.csv"], 170.0).expect("written");
    assert_eq!(names(&out), ["a.csv", "b.csv", "dataset.toml", "own"]);
    assert_eq!(fs::read_to_string(out.join("own/deep/notes.txt")).expect("there"), "mine");
    assert_eq!(fs::read_to_string(out.join("b.csv")).expect("there"), "edited by hand");

    // A trial of another data set has the name of a trial of this one.
    let set = DataSet::read(&out).expect("read");
    load(&set.trials[0], &out).expect("its own");
    fs::write(out.join("a.csv"), "time_s,length_mm\n0,180\n0.01,181\n").expect("written");
    let error = load(&set.trials[0], &out).expect_err("not its own");
    for part in ["dataset.toml", "a.csv", "two data sets may be mixed", "remove this line"] {
        assert!(error.to_string().contains(part), "{error}");
    }
    // A data set that is written by hand has no digest.
    let mut by_hand = set.trials[0].clone();
    by_hand.digest = None;
    load(&by_hand, &out).expect("read");
}
