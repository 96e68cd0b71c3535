//! The bytes of the cases do not change between versions, so that published cases can be made
//! again.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use stretch_blind::{Plan, make};

fn files(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(dir).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { files(&path, found) } else { found.push(path) }
    }
}

#[test]
fn cases_keep_their_bits() {
    let plan =
        Plan { single: 1, null: 1, compound: 1, out_of_catalogue: 1, struck: 1, ..Plan::of(0) };
    let dir = tempfile::tempdir().expect("a temporary folder");
    make(dir.path(), 42, &plan, &|_| {}).expect("cases");
    let mut paths = Vec::new();
    files(dir.path(), &mut paths);
    paths.sort();
    let mut hash = Sha256::new();
    for path in &paths {
        hash.update(path.strip_prefix(dir.path()).expect("inside").to_string_lossy().as_bytes());
        hash.update(fs::read(path).expect("a file"));
    }
    let hex: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    assert_eq!(hex, "484891f7b061d74d5895bb98beb61d0064dbdfefc84cc09070d4569ea4026be1");
}
