//! A folder with a data set, a trial and a rig file, each of any bytes: read with all that hangs on it.
#![no_main]

use std::{fs, path::PathBuf, sync::OnceLock};

use libfuzzer_sys::fuzz_target;
use stretch_data::{DataSet, RigFile};
use stretch_recording::{ReadOptions, Recording};

/// Between two files.
const CUT: u8 = 0;
const FILES: [&str; 4] = ["dataset.toml", "a.csv", "b.csv", "rig.toml"];

/// One a process, in memory where there is such a file system.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let memory = PathBuf::from("/dev/shm");
        let base = if memory.is_dir() { memory } else { std::env::temp_dir() };
        let folder = base.join(format!("stretch-fuzz-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        folder
    })
}

fuzz_target!(|bytes: &[u8]| {
    let folder = folder();
    let mut parts = bytes.split(|&byte| byte == CUT);
    for name in FILES {
        fs::write(folder.join(name), parts.next().unwrap_or_default()).expect("a file");
    }
    let Ok(set) = DataSet::read(folder) else { return };
    let _ = set.rig.as_ref().map(|rig| RigFile::read(folder.join(rig)));
    if let Ok(trials) = Recording::session(&set, folder, &ReadOptions::new()) {
        assert!(trials.iter().all(|trial| trial.trial.check_lengths().is_ok()));
    }
});
