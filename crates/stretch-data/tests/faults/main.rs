//! Tests with a file system that fails at any of its calls, once or from then on, and with a program that is killed
//! before any of them. The output must be old or new, never a mixture.
//!
//! The failing hook is set once in the life of a process, so all failures are in one test. The
//! program that is killed is the example `killed_writer`.
#![cfg(unix)]

mod job;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use job::{JOBS, Job, Plan, hook, under};
use stretch_data::files::ask_before_disk_calls;

type Files = BTreeMap<String, String>;

/// Returns a temporary folder, in memory if possible, because syncing takes no time there.
fn scratch() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.unwrap()
}

/// Returns the text of every file below a folder.
fn tree(folder: &Path) -> Files {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            let below = tree(&entry.path()).into_iter();
            files.extend(below.map(|(path, text)| (format!("{name}/{path}"), text)));
        } else {
            files.insert(name, fs::read_to_string(entry.path()).unwrap());
        }
    }
    files
}

/// Returns the files that do not have a temporary name.
fn kept(at: &Path) -> Files {
    let mut files = tree(at);
    files.retain(|name, _| !name.split('/').any(|part| part.starts_with(".stretch-")));
    files
}

/// Returns the files expected before and after a job.
fn expected(job: Job) -> [Files; 2] {
    let [before, after] = [(); 2].map(|()| scratch());
    for folder in [&before, &after] {
        job.prepare(folder.path());
    }
    job.run(after.path()).unwrap();
    [before, after].map(|folder| tree(folder.path()))
}

/// Whether all files have the content from before the job or all have the content from after it, as far as the job
/// promises this.
///
/// Several files are renamed one after the other, so each of them is old or new. If the system cannot swap two names in
/// one step, a replaced folder may still have its temporary name when the process dies or all calls fail.
fn is_old_or_new(job: Job, exchanges: bool, at: &Path, [before, after]: &[Files; 2]) -> bool {
    let found = kept(at);
    if job == Job::Together {
        let is_whole = |(name, text): (&String, &String)| {
            Some(text) == before.get(name) || Some(text) == after.get(name)
        };
        return found.iter().all(is_whole) && before.keys().all(|name| found.contains_key(name));
    }
    found == *before
        || found == *after
        || (job == Job::Folder && !exchanges && is_aside(at, before))
}

/// Whether the complete old folder has a temporary name, as it does while the new folder is renamed to the target.
fn is_aside(at: &Path, before: &Files) -> bool {
    let inside = tree(at).into_iter().filter_map(|(name, text)| {
        let (temporary, path) = name.split_once(".old/")?;
        temporary.starts_with(".stretch-").then(|| (format!("set/{path}"), text))
    });
    kept(at).is_empty() && inside.collect::<Files>() == *before
}

fn fails_at_every_call(job: Job, and_on: bool, exchanges: bool) -> usize {
    let expected = expected(job);
    for at in 1.. {
        let scratch = scratch();
        job.prepare(scratch.path());
        let plan = Plan { at, and_on, exchanges, kills: false };
        let (result, acted) = under(plan, || job.run(scratch.path()));
        let case = format!("{job:?}, {plan:?}: {result:?}");
        // A single failure can always be undone.
        let is_aside_allowed = exchanges || !and_on;
        let found = kept(scratch.path());
        assert!(
            is_old_or_new(job, is_aside_allowed, scratch.path(), &expected),
            "{case}: {found:#?}"
        );
        if result.is_ok() {
            assert_eq!(found, expected[1], "{case}");
        }
        if let Err(error) = &result {
            let message = error.to_string();
            assert_eq!(message.matches("No space left on device").count(), 1, "{message}");
        }
        if !acted {
            // No other file remains next to the target.
            assert_eq!(tree(scratch.path()), expected[1], "{case}");
            return at;
        }
    }
    0
}

/// Returns the command of the example that is killed. `cargo test` builds it with the tests.
fn killed_writer() -> Command {
    let tests = std::env::current_exe().unwrap();
    let folder: PathBuf = tests.ancestors().nth(2).unwrap().join("examples");
    let program = folder.join("killed_writer");
    assert!(program.is_file(), "{}: cargo build --examples builds it", program.display());
    Command::new(program)
}

fn is_killed_before_every_call(job: Job, exchanges: bool) -> usize {
    let expected = expected(job);
    for at in 1.. {
        let scratch = scratch();
        job.prepare(scratch.path());
        let number = JOBS.iter().position(|other| *other == job).unwrap().to_string();
        let mut child = killed_writer();
        child.args(["kill", &number, &at.to_string(), &exchanges.to_string()]).arg(scratch.path());
        let status = child.output().unwrap().status;
        let case = format!("{job:?} killed before call {at}, exchanges: {exchanges}");
        let found = kept(scratch.path());
        assert!(is_old_or_new(job, exchanges, scratch.path(), &expected), "{case}: {found:#?}");
        if status.success() {
            assert_eq!(tree(scratch.path()), expected[1], "{case}");
            return at;
        }
        // The next run is not blocked, and the user's files still exist.
        if job == Job::Folder && exchanges {
            job.run(scratch.path()).expect(&case);
            assert_eq!(kept(scratch.path()), expected[1], "{case}");
        }
    }
    0
}

#[test]
fn old_or_new_whatever_fails() {
    assert!(ask_before_disk_calls(hook));
    for job in JOBS {
        for exchanges in [true, false] {
            let [once, on] =
                [false, true].map(|and_on| fails_at_every_call(job, and_on, exchanges) - 1);
            let killed = is_killed_before_every_call(job, exchanges) - 1;
            println!(
                "{job:?}, swapped in one step: {exchanges}: {once} calls failed once, {on} from then on, {killed} kills"
            );
            assert!(once > 4 && on > 4 && killed > 4, "{job:?}");
        }
    }
}

#[test]
fn ctrl_c_while_a_folder_is_written_leaves_nothing() {
    let scratch = scratch();
    fs::create_dir(scratch.path().join("set")).unwrap();
    fs::write(scratch.path().join("set/mine"), "mine").unwrap();
    let before = tree(scratch.path());
    let output = killed_writer().arg("ctrl-c").arg(scratch.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(tree(scratch.path()), before);
}
