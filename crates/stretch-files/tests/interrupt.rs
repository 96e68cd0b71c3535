//! Ctrl-C in the middle of writing. A process of its own: the flag stays set.

use std::{fs, path::Path};

use stretch_files::{FileError, interrupt, interrupted, write_folder, write_whole, writers_open};

#[test]
fn an_interrupt_cleans_up_and_stays() {
    let parent = tempfile::tempdir().expect("a folder");
    let (set, file) = (parent.path().join("set"), parent.path().join("out.csv"));
    assert!(!interrupted());
    let error = write_folder(&set, false, |folder: &Path| {
        write_whole(folder.join("done.csv"), |out| out.write_all(b"x"))?;
        write_whole(folder.join("half.csv"), |out| {
            out.write_all(&vec![b'x'; 1 << 20])?;
            assert_eq!(interrupt(), 1, "the handler lets it end, and the folder with it");
            out.write_all(&vec![b'x'; 1 << 20])
        })
    })
    .expect_err("interrupted");
    assert!(matches!(error, FileError::Interrupted { .. }));
    assert!(error.to_string().ends_with("half.csv: interrupted; nothing was written"), "{error}");
    assert_eq!(writers_open(), 0);

    // From now on nothing can be begun: the handler may leave at once.
    let error = write_whole(&file, |_| Ok(())).expect_err("interrupted");
    assert_eq!(error.to_string(), format!("{}: interrupted; nothing was written", file.display()));
    assert_eq!(interrupt(), 0);
    assert_eq!(fs::read_dir(parent.path()).expect("a folder").count(), 0);
}
