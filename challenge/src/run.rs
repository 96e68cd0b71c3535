//! Diagnoses every case in a separate process and folder that contain no labels.

use std::{
    fs, iter,
    panic::resume_unwind,
    path::{Path, PathBuf},
    process::Command,
    sync::atomic::{
        AtomicBool, AtomicUsize,
        Ordering::{Relaxed, SeqCst},
    },
    thread,
};

use anyhow::{Context, ensure};
use stretch_data::files::{clean_up_and_exit, write_whole};
use stretch_gap::{Diagnosis, Evidence, Options, diagnose, threads};
use stretch_problem::{Problem, Reading, RigSimulator};
use stretch_sim::Catalogue;
use tempfile::TempDir;

use crate::{
    score::{ANSWER, case_folders},
    text::progress,
};

/// File with the reason why there is no answer.
const REFUSAL: &str = "refusal.txt";
/// File with information that the diagnosis may use in addition to the data.
const HINT: &str = "hint.toml";

/// Options of the diagnosis of cases.
#[derive(Debug, Clone, clap::Args)]
pub struct RunOptions {
    /// Number of cases that are diagnosed at the same time [default: one per core]
    #[arg(long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Diagnose cases again that have an answer
    #[arg(long)]
    pub again: bool,
    /// Program that diagnoses the cases in place of this one, called as `PROGRAM diagnose . --json=diagnosis.json
    /// --no-next`, with --without EFFECT added if an effect is left out; `stretch` is such a program
    #[arg(long, value_name = "PROGRAM")]
    pub program: Option<PathBuf>,
}

/// Whether temporary folders of cases may exist, which a Ctrl-C has to remove.
static RUNNING: AtomicBool = AtomicBool::new(false);
static STOPPED: AtomicBool = AtomicBool::new(false);

/// Handles Ctrl-C. While cases are diagnosed, the first Ctrl-C requests a stop that removes their
/// folders. Any other ends the program at once.
pub fn on_ctrl_c() {
    if STOPPED.swap(true, SeqCst) || !RUNNING.load(SeqCst) {
        clean_up_and_exit(130);
    }
}

/// Whether a stop was requested by Ctrl-C.
pub fn is_stopped() -> bool {
    STOPPED.load(SeqCst)
}

/// Diagnoses every case of a folder that has no answer yet. Returns the number of cases with an
/// answer, and the number of all cases.
///
/// # Errors
/// Labels that are not sealed, an interrupted diagnosis, Ctrl-C.
pub fn run_cases(folder: &Path, options: &RunOptions) -> anyhow::Result<(usize, usize)> {
    ensure!(
        folder.join("seal.sha256").is_file(),
        "{}: the labels are not sealed (no seal.sha256): make the cases first",
        folder.display()
    );
    RUNNING.store(true, SeqCst);
    let program = match &options.program {
        Some(program) => program.clone(),
        None => std::env::current_exe().context("the program's own path")?,
    };
    let all = case_folders(folder)?;
    let waiting: Vec<&(String, PathBuf)> =
        all.iter().filter(|(_, path)| options.again || !path.join(ANSWER).is_file()).collect();
    let progress = progress("diagnosing", waiting.len());
    let jobs = options.jobs.unwrap_or_else(|| threads(0));
    shared_out(jobs, waiting.len(), |at| {
        let (name, path) = waiting[at];
        ensure!(!is_stopped(), "interrupted");
        answer(&program, path, jobs == 1).with_context(|| name.clone())?;
        progress.inc(1);
        Ok(())
    })?;
    RUNNING.store(false, SeqCst);
    Ok((all.iter().filter(|(_, path)| path.join(ANSWER).is_file()).count(), all.len()))
}

/// Diagnoses one case in a process that is given a copy of its data and nothing else.
fn answer(program: &Path, case: &Path, is_alone: bool) -> anyhow::Result<()> {
    let room = Room::of(case)?;
    let mut command = room.command(program);
    command.args(["diagnose", ".", &format!("--json={ANSWER}"), "--no-next"]);
    for name in without(case)? {
        command.args(["--without", &name]);
    }
    if !is_alone {
        command.env("RAYON_NUM_THREADS", "1");
    }
    let output =
        command.output().with_context(|| format!("{}: it cannot be run", program.display()))?;
    let (file, text) = if output.status.success() {
        (ANSWER, room.read(ANSWER)?)
    } else {
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        ensure!(output.status.code() == Some(1), "the diagnosis broke off: {why}");
        // a refusal is stored, too: it is scored as a case without an answer
        (REFUSAL, why)
    };
    room.close()?;
    Ok(write_whole(case.join(file), |out| out.write_all(text.as_bytes()))?)
}

/// Returns the effects that the `hint.toml` of a case removes from the catalogue.
fn without(case: &Path) -> anyhow::Result<Vec<String>> {
    #[derive(serde::Deserialize)]
    struct Hint {
        #[serde(default)]
        without: Vec<String>,
    }
    let path = case.join(HINT);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let hint: Hint = toml::from_str(&text).with_context(|| path.display().to_string())?;
    Ok(hint.without)
}

/// A copy of one case's data in a new temporary folder, which is removed on drop.
///
/// The diagnosing process works in this folder. Its working folder, its arguments and its
/// environment do not name the folder of the labels. A program that searched the disk could still
/// find the labels, because it runs as the same user.
struct Room {
    dir: TempDir,
    folder: PathBuf,
}

impl Room {
    /// Copies the data of a case.
    fn of(case: &Path) -> anyhow::Result<Self> {
        let dir = TempDir::with_prefix("stretch-").context("temporary folder")?;
        let name = case.file_name().map_or_else(|| "case".into(), ToOwned::to_owned);
        let folder = dir.path().join(name);
        let copied = || -> std::io::Result<()> {
            fs::create_dir(&folder)?;
            for entry in fs::read_dir(case)? {
                let entry = entry?;
                let name = entry.file_name();
                // Links are not copied, because they may point to files outside the case.
                if entry.file_type()?.is_file()
                    && ![ANSWER, REFUSAL, HINT].iter().any(|w| name == *w)
                {
                    fs::copy(entry.path(), folder.join(name))?;
                }
            }
            Ok(())
        };
        copied().with_context(|| format!("{}: it cannot be copied", case.display()))?;
        Ok(Self { dir, folder })
    }

    /// Returns a command that runs in the folder, and whose environment names no other folder.
    fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.folder).env("PWD", &self.folder).env_remove("OLDPWD");
        // The shell stores the last command in this variable, with the name of the folder.
        command.env_remove("_");
        command
    }

    /// Reads a file that the program wrote into the folder.
    fn read(&self, file: &str) -> anyhow::Result<String> {
        let path = self.folder.join(file);
        fs::read_to_string(&path).with_context(|| path.display().to_string())
    }

    /// Removes the folder, and returns an error if this fails.
    fn close(self) -> anyhow::Result<()> {
        let shown = self.dir.path().display().to_string();
        self.dir.close().with_context(|| format!("{shown}: it cannot be removed"))
    }
}

/// Runs `count` jobs on `threads` threads and returns their results in order. These are not threads
/// of rayon, because a diagnosis has its own pool, and a waiting rayon worker would begin the next
/// job inside the first.
///
/// # Errors
/// The error of the first failed job, in order; no job begins after one has failed.
///
/// ```
/// let squares = stretch_challenge::shared_out(2, 4, |i| Ok(i * i))?;
/// assert_eq!(squares, [0, 1, 4, 9]);
/// # Ok::<(), anyhow::Error>(())
/// ```
pub fn shared_out<T: Send>(
    workers: usize,
    count: usize,
    job: impl Fn(usize) -> anyhow::Result<T> + Sync,
) -> anyhow::Result<Vec<T>> {
    let next = AtomicUsize::new(0);
    let work = || -> Vec<(usize, anyhow::Result<T>)> {
        let jobs = iter::from_fn(|| Some(next.fetch_add(1, Relaxed)).filter(|at| *at < count));
        let done = jobs.map(|at| {
            let result = job(at);
            if result.is_err() {
                next.store(count, Relaxed);
            }
            (at, result)
        });
        done.collect()
    };
    let mut done: Vec<_> = thread::scope(|scope| {
        let started: Vec<_> =
            (0..workers.clamp(1, count.max(1))).map(|_| scope.spawn(work)).collect();
        let ended = started.into_iter().map(|thread| thread.join());
        ended.flat_map(|done| done.unwrap_or_else(|panic| resume_unwind(panic))).collect()
    });
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}

/// Arguments of the command that diagnoses one folder.
#[derive(Debug, Clone, clap::Args)]
pub struct Asked {
    folder: PathBuf,
    #[arg(long)]
    json: PathBuf,
    /// Effects that the catalogue must do without
    #[arg(long)]
    without: Vec<String>,
    /// No further experiment is ever looked for; `stretch diagnose` asks for that with this
    #[arg(long)]
    no_next: bool,
}

/// Diagnoses the data set of a folder as `stretch diagnose FOLDER` does, and writes the JSON.
///
/// # Errors
/// Data that the diagnosis refuses, a file that cannot be written.
pub fn write_diagnosis(asked: &Asked) -> anyhow::Result<()> {
    let reading = Reading { without: &asked.without, ..Reading::default() };
    let problem = Problem::read(&asked.folder, &reading)?;
    let examined = problem.examine(&Options::default(), false, &|_| (), &|| false)?;
    let text = serde_json::to_string_pretty(&examined.to_json())? + "\n";
    Ok(write_whole(&asked.json, |out| out.write_all(text.as_bytes()))?)
}

/// Diagnoses a case in this process with the given options. For tools that may read the label.
///
/// # Errors
/// Data that the diagnosis refuses, or a removed effect that does not exist.
pub fn diagnosed(
    folder: &Path,
    without: &[impl AsRef<str>],
    options: &Options,
    progress: &(dyn Fn(&str) + Sync),
) -> anyhow::Result<(Diagnosis, Evidence)> {
    let catalogue = Catalogue::default().without(without)?;
    let simulator = RigSimulator::read(folder, None, &catalogue, Default::default())?;
    Ok(diagnose(&simulator, options, progress, &|| false)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_the_data_and_nothing_else() {
        let check = tempfile::tempdir().unwrap();
        let case = check.path().join("case-000");
        fs::create_dir_all(check.path().join("sealed")).unwrap();
        fs::create_dir(&case).unwrap();
        fs::write(check.path().join("sealed/truth.json"), "{}").unwrap();
        for file in ["dataset.toml", "a.csv", "diagnosis.json"] {
            fs::write(case.join(file), file).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("../sealed/truth.json", case.join("link.json")).unwrap();
        let room = Room::of(&case).unwrap();
        let listed = |folder: &Path| {
            let entries = fs::read_dir(folder).unwrap();
            let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        assert_eq!(listed(&room.folder), ["a.csv", "dataset.toml"]);
        // The folder contains only the case, and no parent folder belongs to the check.
        let above = room.folder.parent().unwrap();
        assert_eq!(listed(above), ["case-000"]);
        assert!(!room.folder.starts_with(check.path()));
        assert_eq!(room.read("a.csv").unwrap(), "a.csv");
        assert!(room.read("diagnosis.json").is_err());
        let above = above.to_owned();
        room.close().unwrap();
        assert!(!above.exists());
    }
}
