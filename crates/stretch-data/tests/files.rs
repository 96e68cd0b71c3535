//! Files and folders are written completely or not at all.

use std::{fs, io, path::Path};

use stretch_data::files::{FileError, Outputs, write_folder, write_whole};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn disk_full() -> io::Error {
    io::Error::from_raw_os_error(28)
}

#[test]
fn a_writer_that_fails_leaves_what_was_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("out.csv");
    for (old, left) in [(None, vec![]), (Some("old"), vec!["out.csv"])] {
        if let Some(old) = old {
            fs::write(&path, old).expect("written");
        }
        let error = write_whole(&path, |out| {
            // The text is longer than any buffer. Therefore a part of it has reached the disk.
            out.write_all(&vec![b'x'; 1 << 20])?;
            Err(disk_full())
        })
        .expect_err("full");
        let message = format!("{}: cannot write it: No space left on device", path.display());
        assert_eq!(error.to_string(), message);
        assert_eq!(names(folder.path()), left);
        assert_eq!(fs::read_to_string(&path).ok().as_deref(), old);
    }
}

#[test]
fn a_reader_never_sees_half_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("out.csv");
    fs::write(&path, "old").expect("written");
    write_whole(&path, |out| {
        out.write_all(&vec![b'x'; 1 << 20])?;
        assert_eq!(fs::read(&path)?, b"old", "not yet");
        Ok(())
    })
    .expect("written");
    assert_eq!(fs::metadata(&path).expect("there").len(), 1 << 20);
}

#[test]
fn places_that_cannot_be_written_to() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let fail = |path: &Path| write_whole(path, |_| Ok(())).expect_err("no").to_string();
    let says = |path: &Path, cause: &str| {
        assert_eq!(fail(path), format!("{}: cannot write it: {cause}", path.display()));
    };
    says(&at("none/out.csv"), "No such file or directory");
    says(folder.path(), "it is a folder; name a file");
    fs::write(at("file"), "").expect("written");
    says(&at("file/out.csv"), "Not a directory");
    let mut read_only = fs::metadata(at("file")).expect("there").permissions();
    read_only.set_readonly(true);
    fs::set_permissions(at("file"), read_only).expect("set");
    says(&at("file"), "it is read-only");
    assert_eq!(names(folder.path()), ["file"]);
}

#[cfg(target_os = "linux")]
#[test]
fn devices_are_written_to_directly() {
    write_whole("/dev/null", |out| out.write_all(b"gone")).expect("takes everything");
    let error = write_whole("/dev/full", |out| out.write_all(b"x")).expect_err("full");
    assert_eq!(error.to_string(), "/dev/full: cannot write it: No space left on device");
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_permissions_stay() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().expect("a folder");
    let (real, link) = (folder.path().join("real"), folder.path().join("link"));
    fs::write(&real, "old").expect("written");
    fs::set_permissions(&real, fs::Permissions::from_mode(0o640)).expect("set");
    symlink("real", &link).expect("linked");
    write_whole(&link, |out| out.write_all(b"new")).expect("written");
    assert!(fs::symlink_metadata(&link).expect("there").is_symlink());
    assert_eq!(fs::read(&real).expect("there"), b"new");
    assert_eq!(fs::metadata(&real).expect("there").permissions().mode() & 0o777, 0o640);
    assert_eq!(names(folder.path()), ["link", "real"]);
}

fn two_files(folder: &Path) -> Result<(), FileError> {
    write_whole(folder.join("a"), |out| out.write_all(b"new a"))?;
    fs::create_dir(folder.join("sub")).map_err(|cause| FileError::Io {
        path: "sub".to_owned(),
        action: "make it",
        cause,
    })?;
    write_whole(folder.join("sub/b"), |out| out.write_all(b"new b"))
}

#[test]
fn a_folder_is_refused_or_filled_and_nothing_else_goes() {
    let parent = tempfile::tempdir().expect("a folder");
    let out = parent.path().join("deep/set");
    write_folder(&out, false, two_files).expect("new");
    assert_eq!(
        (names(&out), names(parent.path())),
        (vec!["a".into(), "sub".into()], vec!["deep".into()])
    );
    fs::write(out.join("a"), "old a").expect("written");
    fs::write(out.join("mine"), "mine").expect("written");
    let error = write_folder(&out, false, two_files).expect_err("exists");
    assert_eq!(
        error.to_string(),
        format!("{}: it exists and is not an empty folder; choose another name", out.display())
    );
    assert_eq!(fs::read(out.join("a")).expect("there"), b"old a");
    write_folder(&out, true, two_files).expect("forced");
    assert_eq!(names(&out), ["a", "mine", "sub"]);
    assert_eq!(fs::read(out.join("a")).expect("there"), b"new a");
    assert_eq!(names(&parent.path().join("deep")), ["set"]);
}

#[test]
fn a_folder_that_fails_midway_is_as_it_was() {
    let parent = tempfile::tempdir().expect("a folder");
    let out = parent.path().join("deep/set");
    let fail = |folder: &Path| -> Result<(), FileError> {
        two_files(folder)?;
        write_whole(folder.join("c"), |_| Err(disk_full()))
    };
    write_folder(&out, false, fail).expect_err("full");
    assert!(names(parent.path()).is_empty(), "the parents that it made are gone, too");

    // A folder is in the place of one of its files: the first file has been moved and must be
    // restored.
    fs::create_dir_all(out.join("sub/b/mine")).expect("made");
    fs::write(out.join("a"), "old a").expect("written");
    let error = write_folder(&out, true, two_files).expect_err("a folder in the way");
    assert!(
        error.to_string().ends_with("sub/b is a folder, but its new version is not"),
        "{error}"
    );
    assert_eq!(fs::read(out.join("a")).expect("there"), b"old a");
    assert!(out.join("sub/b/mine").is_dir());
    assert_eq!(names(&parent.path().join("deep")), ["set"]);
}

#[test]
fn the_folder_one_is_in_is_not_replaced() {
    let here = std::env::current_dir().expect("a folder");
    let before = names(&here);
    let error = write_folder(&here, true, |_| Ok::<_, FileError>(())).expect_err("here");
    assert!(error.to_string().contains("in which a program is run"), "{error}");
    assert_eq!(names(&here), before);
}

#[test]
fn an_empty_folder_is_filled_and_a_file_is_in_the_way() {
    let parent = tempfile::tempdir().expect("a folder");
    let out = parent.path().join("set");
    fs::create_dir(&out).expect("made");
    write_folder(&out, false, two_files).expect("it was empty");
    assert_eq!(names(&out), ["a", "sub"]);
    fs::write(parent.path().join("file"), "mine").expect("written");
    for force in [false, true] {
        write_folder(parent.path().join("file"), force, two_files).expect_err("a file");
    }
    assert_eq!(fs::read_to_string(parent.path().join("file")).expect("there"), "mine");
    assert_eq!(names(parent.path()), ["file", "set"]);
}

#[test]
fn of_two_writers_at_once_one_has_written_all() {
    let parent = tempfile::tempdir().expect("a folder");
    for force in [false, true] {
        let out = parent.path().join(format!("set_{force}"));
        if force {
            fs::create_dir(&out).expect("made");
            fs::write(out.join("mine"), "mine").expect("written");
        }
        let write = |who: &str| {
            write_folder(&out, force, |folder| {
                for name in ["a", "b", "c"] {
                    write_whole(folder.join(name), |file| file.write_all(who.as_bytes()))?;
                }
                Ok::<_, FileError>(())
            })
        };
        let results: Vec<_> = std::thread::scope(|scope| {
            let writers =
                ["one", "two", "three", "four"].map(|who| scope.spawn(move || write(who)));
            writers.into_iter().map(|writer| writer.join().expect("no panic")).collect()
        });
        let done = results.iter().filter(|result| result.is_ok()).count();
        assert!(if force { done == 4 } else { done == 1 }, "{results:?}");
        for failed in results.iter().filter_map(|result| result.as_ref().err()) {
            assert!(matches!(failed, FileError::Exists { .. }), "{failed}");
        }
        let whose = ["a", "b", "c"].map(|name| fs::read(out.join(name)).expect("there"));
        assert!(whose[0] == whose[1] && whose[1] == whose[2], "mixed");
        assert_eq!(out.join("mine").exists(), force);
    }
    assert_eq!(names(parent.path()).len(), 2, "nothing stays beside them");
}

#[test]
fn writers_at_once_lose_nothing_of_the_users() {
    let parent = tempfile::tempdir().expect("a folder");
    let out = parent.path().join("set");
    fs::create_dir_all(out.join("own")).expect("made");
    for i in 0..100 {
        fs::write(out.join(format!("own/{i}")), "mine").expect("written");
    }
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..10 {
                    write_folder(&out, true, two_files).expect("another writer is waited for");
                }
            });
        }
    });
    assert_eq!(names(parent.path()), ["set"], "nothing else is left");
    assert_eq!(names(&out), ["a", "own", "sub"]);
    for i in 0..100 {
        assert_eq!(fs::read(out.join(format!("own/{i}"))).expect("there"), b"mine");
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_is_written_to_and_one_without_a_reader_is_refused() {
    use std::process::Command;
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("pipe");
    assert!(Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()));
    let error = write_whole(&pipe, |out| out.write_all(b"x")).expect_err("nobody reads");
    assert!(error.to_string().contains("no program reads this pipe"), "{error}");
    let read = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).expect("read")
    });
    // The text is longer than the buffer of a pipe. Therefore the writer waits for the reader.
    let text = vec![b'x'; 1 << 18];
    write_whole(&pipe, |out| out.write_all(&text)).expect("written");
    assert!(read.join().expect("no panic") == text);
    let read = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).expect("read")
    });
    let mut outputs = Outputs::default();
    outputs.file(&pipe, |out| out.write_all(b"streamed")).expect("kept");
    outputs.file(folder.path().join("file"), |out| out.write_all(b"whole")).expect("staged");
    outputs.keep().expect("written");
    assert_eq!(read.join().expect("no panic"), b"streamed");
    use std::os::unix::fs::FileTypeExt;
    assert!(fs::metadata(&pipe).expect("there").file_type().is_fifo(), "still a pipe");
    let error = write_whole("/dev/stdin", |_| Ok(())).expect_err("it is read");
    assert!(error.to_string().contains("standard input, which cannot be written"), "{error}");
}
