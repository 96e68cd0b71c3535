//! The write operations under test, and a file system that fails.

use std::{
    fs,
    io::{self, Write},
    path::Path,
    sync::Mutex,
};

use stretch_data::files::{FileError, Outputs, write_folder, write_whole};

/// Which of the next file-system calls fail.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Plan {
    /// Number of the first call that fails; 0 for none.
    pub(crate) at: usize,
    /// Whether all later calls fail, too.
    pub(crate) and_on: bool,
    /// Whether the process aborts at that call instead.
    pub(crate) kills: bool,
    /// Whether two names can be swapped in one step.
    pub(crate) exchanges: bool,
}

static STATE: Mutex<(Plan, usize)> =
    Mutex::new((Plan { at: 0, and_on: false, kills: false, exchanges: true }, 0));

pub(crate) fn hook(call: &'static str) -> io::Result<()> {
    let mut state = STATE.lock().unwrap();
    let (plan, calls) = &mut *state;
    *calls += 1;
    if *calls == plan.at || (plan.and_on && plan.at > 0 && *calls > plan.at) {
        if plan.kills {
            // As after kill -9, nothing is cleaned up.
            std::process::abort();
        }
        // No space left on device (ENOSPC).
        return Err(io::Error::from_raw_os_error(28));
    }
    match call {
        "exchange" if !plan.exchanges => Err(io::ErrorKind::Unsupported.into()),
        _ => Ok(()),
    }
}

/// Runs a function under a plan. Also returns whether the plan's call number was reached.
pub(crate) fn under<T>(plan: Plan, run: impl FnOnce() -> T) -> (T, bool) {
    *STATE.lock().unwrap() = (plan, 0);
    let answer = run();
    let mut state = STATE.lock().unwrap();
    let acted = state.1 >= plan.at;
    *state = (Plan { exchanges: true, ..Plan::default() }, 0);
    (answer, acted)
}

/// A write operation under test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Job {
    File,
    NewFolder,
    Folder,
    Together,
}

pub(crate) const JOBS: [Job; 4] = [Job::File, Job::NewFolder, Job::Folder, Job::Together];

impl Job {
    /// Creates the files that exist before the operation.
    pub(crate) fn prepare(self, at: &Path) {
        if self == Self::NewFolder {
            return;
        }
        fs::create_dir_all(at.join("set/own")).unwrap();
        for name in ["set/a", "set/own/notes", "set/mine"] {
            fs::write(at.join(name), format!("old {name}")).unwrap();
        }
        // A `dataset.toml` with the digests of two trials, of which one was changed afterwards.
        let digest = |name: &str, digest: &str| {
            format!(
                "[[trial]]\nfile = '{name}'\nkind = 'other'\nsplit = 'fit'\ndigest = 'crc32c {digest}'\n"
            )
        };
        // CRC-32C of "123456789"
        let index = "name = 'old'\nrate_hz = 100\n".to_owned()
            + &digest("gone", "e3069283")
            + &digest("changed", "e3069283");
        fs::write(at.join("set/dataset.toml"), index).unwrap();
        fs::write(at.join("set/gone"), "123456789").unwrap();
        fs::write(at.join("set/changed"), "not that any more").unwrap();
    }

    pub(crate) fn run(self, at: &Path) -> Result<(), FileError> {
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
}
