//! Property tests of the functions that write files and folders, with random contents and failures.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::Path,
};

use proptest::prelude::*;
use stretch_data::{
    DataSet, Split, TrialEntry, TrialKind,
    files::{FileError, Outputs, read_whole, write_folder, write_whole},
};

use crate::cases;

/// Contents of the files of a folder by path, with `/` as separator.
type Tree = BTreeMap<String, Vec<u8>>;

/// Paths of which none is both a file and a folder.
const NAMES: [&str; 6] = ["a", "b", "c", "sub/a", "sub/b", "sub/deep/a"];

fn trees() -> impl Strategy<Value = Tree> {
    let file = (prop::sample::select(&NAMES[..]), prop::collection::vec(any::<u8>(), 0..9));
    prop::collection::vec(file, 0..6)
        .prop_map(|files| files.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)).collect())
}

fn write_tree(folder: &Path, tree: &Tree) {
    for (name, bytes) in tree {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        fs::write(path, bytes).expect("written");
    }
}

/// Reads all files below a folder, including temporary ones.
fn read_tree(folder: &Path) -> Tree {
    let mut tree = Tree::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let entry = entry.expect("an entry");
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            let inner = read_tree(&entry.path());
            tree.extend(inner.into_iter().map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
        } else {
            tree.insert(name, fs::read(entry.path()).expect("read"));
        }
    }
    tree
}

fn fill(folder: &Path, tree: &Tree) -> Result<(), FileError> {
    write_tree(folder, tree);
    Ok(())
}

proptest! {
    #![proptest_config(cases(24))]

    /// Either all of several files are new, or, if one of them fails, all are unchanged.
    #[test]
    fn outputs_are_kept_together(
        old in trees(),
        new in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..40), 1..5),
        fails in prop::option::of(0..5_usize),
    ) {
        let folder = tempfile::tempdir().expect("a folder");
        write_tree(folder.path(), &old);
        let mut outputs = Outputs::default();
        let mut result = Ok(());
        for (i, bytes) in new.iter().enumerate() {
            let path = folder.path().join(format!("{}.out", i % 4));
            result = result.and_then(|()| outputs.file(path, |out| {
                out.write_all(bytes)?;
                if fails == Some(i) { Err(io::Error::other("no")) } else { Ok(()) }
            }));
        }
        let is_failed = fails.is_some_and(|i| i < new.len());
        prop_assert_eq!(result.is_err(), is_failed, "{:?}", result);
        if is_failed {
            drop(outputs);
            prop_assert_eq!(read_tree(folder.path()), old);
        } else {
            outputs.keep().expect("kept");
            let mut wanted = old;
            wanted.extend(new.into_iter().enumerate().map(|(i, bytes)| (format!("{i}.out"), bytes)));
            prop_assert_eq!(read_tree(folder.path()), wanted);
        }
    }

    /// A file reads back as written, and a second writer either replaces it or changes nothing.
    #[test]
    fn a_file_is_one_of_those_that_were_written(
        first in prop::collection::vec(any::<u8>(), 0..3000),
        second in prop::collection::vec(any::<u8>(), 0..3000),
        pieces in 1..700_usize,
        fails in any::<bool>(),
    ) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        write_whole(&path, |out| out.write_all(&first)).expect("written");
        let again = write_whole(&path, |out| {
            second.chunks(pieces).try_for_each(|piece| out.write_all(piece))?;
            if fails { Err(io::Error::other("no")) } else { Ok(()) }
        });
        prop_assert_eq!(again.is_err(), fails);
        prop_assert_eq!(read_whole(&path).expect("read"), if fails { first } else { second });
        prop_assert_eq!(read_tree(folder.path()).len(), 1, "no temporary name stays");
    }

    /// A replaced folder has every new file, and every other file of the old one.
    #[test]
    fn a_folder_is_new_over_old(old in trees(), new in trees(), force in any::<bool>(), fails in any::<bool>()) {
        let parent = tempfile::tempdir().expect("a folder");
        let out = parent.path().join("set");
        write_tree(&out, &old);
        let result = write_folder(&out, force, |folder| {
            fill(folder, &new)?;
            match fails {
                true => write_whole(folder.join("last"), |_| Err(io::Error::other("no"))),
                false => Ok(()),
            }
        });
        prop_assert_eq!(result.is_ok(), !fails && (force || old.is_empty()), "{:?}", result);
        let wanted = match result {
            Ok(()) => old.into_iter().chain(new).collect(),
            Err(_) => old,
        };
        prop_assert_eq!(read_tree(&out), wanted);
        let left: BTreeSet<_> = fs::read_dir(parent.path()).expect("a folder").map(|e| e.expect("an entry").file_name()).collect();
        prop_assert!(left.iter().all(|name| name == "set"), "{:?}", left);
    }

    /// A written data set reads back, with digests that detect every change of a trial's file.
    #[test]
    fn a_data_set_on_the_disk_is_checked_byte_by_byte(
        trials in prop::collection::vec(stretch_strategies::rig_trial(2..20), 1..4),
        which in any::<prop::sample::Index>(),
        at in any::<prop::sample::Index>(),
        change in 1..=255_u8,
    ) {
        let parent = tempfile::tempdir().expect("a folder");
        let folder = parent.path().join("set");
        let entry = |i: usize| TrialEntry {
            file: format!("trials/{i}.csv"),
            kind: TrialKind::Other,
            opening: None,
            start_s: 60.0 * i as f64,
            split: if i == 0 { Split::Test } else { Split::Fit },
            digest: None,
        };
        let mut set = DataSet { name: "bench".into(), rate_hz: 100.0, rig: None, trials: (0..trials.len()).map(entry).collect() };
        fs::create_dir_all(folder.join("trials")).expect("made");
        for (trial, entry) in trials.iter().zip(&set.trials) {
            trial.write(folder.join(&entry.file)).expect("written");
        }
        set.take_digests(&folder).expect("digests");
        set.write(&folder).expect("written");
        prop_assert_eq!(&DataSet::read(&folder).expect("read"), &set);
        prop_assert!(set.trials.iter().all(|entry| entry.check_file(&folder).is_ok()));
        // One byte of one file.
        let entry = &set.trials[which.index(set.trials.len())];
        let path = folder.join(&entry.file);
        let mut bytes = fs::read(&path).expect("read");
        let at = at.index(bytes.len());
        bytes[at] ^= change;
        fs::write(&path, &bytes).expect("written");
        let error = entry.check_file(&folder).expect_err("changed").to_string();
        prop_assert!(error.contains(&entry.file), "{}", error);
        let others = set.trials.iter().filter(|other| *other != entry);
        prop_assert!(others.into_iter().all(|other| other.check_file(&folder).is_ok()));
    }
}
