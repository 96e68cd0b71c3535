//! A file system that fails at any of its calls, once or from then on, and a program that is killed
//! before any of them: what is written is old or new, never between.
//!
//! The hook that fails is asked once a process, so all of it is one test, and a kill is a child's.
#![cfg(unix)]

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::Command,
    sync::Mutex,
};

use stretch_files::{
    DiskCall, FileError, Outputs, ask_before_disk_calls, recover, write_folder, write_whole,
};

/// Where syncing takes no time, if there is such a place.
fn scratch() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
    made.unwrap()
}

/// What the next calls come to.
#[derive(Debug, Clone, Copy, Default)]
struct Plan {
    /// Number of the first call that fails; 0 for none.
    at: usize,
    /// Whether all later ones fail, too.
    and_on: bool,
    /// Whether the process ends there instead.
    kills: bool,
    /// Whether two names can be swapped in one step.
    exchanges: bool,
}

static STATE: Mutex<(Plan, usize)> =
    Mutex::new((Plan { at: 0, and_on: false, kills: false, exchanges: true }, 0));

fn hook(call: DiskCall) -> io::Result<()> {
    let mut state = STATE.lock().unwrap();
    let (plan, calls) = &mut *state;
    *calls += 1;
    if *calls == plan.at || (plan.and_on && plan.at > 0 && *calls > plan.at) {
        if plan.kills {
            // as by kill -9: nothing is cleaned up
            std::process::abort();
        }
        // no space left on the device
        return Err(io::Error::from_raw_os_error(28));
    }
    match call {
        DiskCall::Exchange if !plan.exchanges => Err(io::ErrorKind::Unsupported.into()),
        _ => Ok(()),
    }
}

/// Runs something under a plan; whether the plan came to act.
fn under<T>(plan: Plan, run: impl FnOnce() -> T) -> (T, bool) {
    *STATE.lock().unwrap() = (plan, 0);
    let answer = run();
    let mut state = STATE.lock().unwrap();
    let acted = state.1 >= plan.at;
    *state = (Plan { exchanges: true, ..Plan::default() }, 0);
    (answer, acted)
}

/// Text of every file below a folder.
fn tree(folder: &Path) -> BTreeMap<String, String> {
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

/// A way to write.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Job {
    File,
    NewFolder,
    Folder,
    Together,
}

const JOBS: [Job; 4] = [Job::File, Job::NewFolder, Job::Folder, Job::Together];

impl Job {
    /// What is there before.
    fn prepare(self, at: &Path) {
        if self == Self::NewFolder {
            return;
        }
        fs::create_dir_all(at.join("set/own")).unwrap();
        for name in ["set/a", "set/own/notes", "set/mine"] {
            fs::write(at.join(name), format!("old {name}")).unwrap();
        }
        // what the last data set was written with, and what was changed in it since
        let digest = |name: &str, digest: &str| {
            format!("[[trial]]\nfile = '{name}'\ndigest = 'crc32c {digest}'\n")
        };
        // CRC-32C of "123456789"
        let index = digest("gone", "e3069283") + &digest("changed", "e3069283");
        fs::write(at.join("set/dataset.toml"), index).unwrap();
        fs::write(at.join("set/gone"), "123456789").unwrap();
        fs::write(at.join("set/changed"), "not that any more").unwrap();
    }

    fn run(self, at: &Path) -> Result<(), FileError> {
        let text = |name: &'static str| move |out: &mut dyn Write| out.write_all(name.as_bytes());
        let fill = |folder: &Path| {
            write_whole(folder.join("a"), text("new a"))?;
            fs::create_dir(folder.join("sub")).unwrap();
            write_whole(folder.join("sub/b"), text("new b"))?;
            write_whole(folder.join("dataset.toml"), text("name = 'new'"))
        };
        match self {
            Self::File => write_whole(at.join("set/a"), text("new a")),
            Self::NewFolder => write_folder(at.join("deep/set"), false, fill),
            Self::Folder => write_folder(at.join("set"), true, fill),
            Self::Together => {
                let mut outputs = Outputs::default();
                outputs.file(at.join("set/a"), text("new a"))?;
                outputs.file(at.join("set/report"), text("new report"))?;
                outputs.folder(at.join("code"), false, |folder| {
                    write_whole(folder.join("c"), text("new c"))
                })?;
                outputs.keep()
            }
        }
    }

    /// Before and after, as they should be.
    fn expected(self) -> [BTreeMap<String, String>; 2] {
        let [before, after] = [(); 2].map(|()| scratch());
        for folder in [&before, &after] {
            self.prepare(folder.path());
        }
        self.run(after.path()).unwrap();
        [before, after].map(|folder| tree(folder.path()))
    }
}

/// What is there under no temporary name.
fn kept(at: &Path) -> BTreeMap<String, String> {
    let mut files = tree(at);
    files.retain(|name, _| !name.split('/').any(|part| part.starts_with(".stretch-")));
    files
}

fn fails_at_every_call(job: Job, and_on: bool, exchanges: bool) -> usize {
    let [before, after] = job.expected();
    for at in 1.. {
        let scratch = scratch();
        job.prepare(scratch.path());
        let plan = Plan { at, and_on, exchanges, kills: false };
        let (result, acted) = under(plan, || job.run(scratch.path()));
        let case = format!("{job:?}, {plan:?}: {result:?}");
        let mut found = kept(scratch.path());
        if found.is_empty() && job == Job::Folder && and_on && !exchanges {
            // even the way back failed: the next run goes on
            assert!(result.is_err(), "{case}");
        }
        if !exchanges && job == Job::Folder && found != before && found != after {
            let said = recover(scratch.path().join("set")).unwrap();
            assert!(said.is_some_and(|said| said.contains("an earlier run was stopped")), "{case}");
            found = kept(scratch.path());
        }
        // several files cannot be taken back at once where nothing can be called any more
        let is_partial = job == Job::Together && (and_on || !exchanges) && result.is_err();
        assert!(found == before || found == after || is_partial, "{case}: {found:#?}");
        if result.is_ok() {
            assert_eq!(found, after, "{case}");
        }
        if is_partial {
            for (name, text) in &found {
                let is_whole = Some(text) == before.get(name) || Some(text) == after.get(name);
                assert!(is_whole, "{case}: {name}: {text}");
            }
        }
        if let Err(error) = &result {
            let said = error.to_string();
            assert_eq!(said.matches("No space left on device").count(), 1, "{said}");
        }
        if !acted {
            assert_eq!(found, after, "{case}");
            // nothing stays beside it
            assert_eq!(tree(scratch.path()), after, "{case}");
            return at;
        }
    }
    0
}

fn is_killed_before_every_call(job: Job, exchanges: bool) -> usize {
    let [before, after] = job.expected();
    for at in 1.. {
        let scratch = scratch();
        job.prepare(scratch.path());
        let status = Command::new(std::env::current_exe().unwrap())
            .args(["a_child_that_is_killed", "--exact", "--quiet"])
            .env("FAULTS_JOB", JOBS.iter().position(|other| *other == job).unwrap().to_string())
            .env("FAULTS_AT", at.to_string())
            .env("FAULTS_EXCHANGES", exchanges.to_string())
            .env("FAULTS_FOLDER", scratch.path())
            .output()
            .unwrap()
            .status;
        let case = format!("{job:?} killed before call {at}, exchanges: {exchanges}");
        let mut found = kept(scratch.path());
        if !exchanges && found != before && found != after && job == Job::Folder {
            let said = recover(scratch.path().join("set")).unwrap().expect(&case);
            assert!(said.contains("an earlier run was stopped"), "{said}");
            found = kept(scratch.path());
        }
        if job == Job::Together {
            for (name, text) in &found {
                let is_whole = Some(text) == before.get(name) || Some(text) == after.get(name);
                assert!(is_whole, "{case}: {name}: {text}");
            }
        } else {
            assert!(found == before || found == after, "{case}: {found:#?}");
        }
        if status.success() {
            assert_eq!(tree(scratch.path()), after, "{case}");
            return at;
        }
        // the next run is not in anybody's way, and what is the user's is still there
        let again = Job::Folder.run(scratch.path());
        assert!(again.is_ok() || job != Job::Folder, "{case}: {again:?}");
        if job == Job::Folder {
            assert_eq!(kept(scratch.path()), after, "{case}");
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

/// What the test above starts as a process of its own; by itself it does nothing.
#[test]
fn a_child_that_is_killed() {
    if std::env::var_os("FAULTS_AT").is_none() {
        return;
    }
    let text = |name: &str| std::env::var(name).unwrap();
    assert!(ask_before_disk_calls(hook));
    let plan = Plan {
        at: text("FAULTS_AT").parse().unwrap(),
        and_on: false,
        kills: true,
        exchanges: text("FAULTS_EXCHANGES").parse().unwrap(),
    };
    let job = JOBS[text("FAULTS_JOB").parse::<usize>().unwrap()];
    let (result, _) = under(plan, || job.run(&PathBuf::from(text("FAULTS_FOLDER"))));
    result.unwrap();
}
