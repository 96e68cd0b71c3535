//! Diagnoses every case in a process and a folder that hold no label.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering::SeqCst},
};

use anyhow::{Context, ensure};
use stretch_data::files::{clean_up_and_exit, write_whole};

use crate::{
    answers::{ANSWER, case_folders},
    room::Room,
    shared_out::{cores, shared_out},
    text::Progress,
};

/// Why there is no answer.
const REFUSAL: &str = "refusal.txt";
/// What the diagnosis may know in addition to the data.
const HINT: &str = "hint.toml";

/// How the cases are diagnosed.
#[derive(Debug, Clone, clap::Args)]
pub struct RunOptions {
    /// Cases diagnosed at a time [default: one a core]
    #[arg(long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Answer again where there is an answer
    #[arg(long)]
    pub again: bool,
    /// Leave out the simpler methods that are run for comparison
    #[arg(long)]
    pub no_baselines: bool,
    /// Program that is asked in place of this one, as `PROGRAM diagnose . --json=diagnosis.json --no-next`,
    /// with --without EFFECT and --baselines behind it; `stretch` is one
    #[arg(long, value_name = "PROGRAM")]
    pub program: Option<PathBuf>,
}

/// Whether case folders may exist, which are removed after a Ctrl-C.
static RUNNING: AtomicBool = AtomicBool::new(false);
static STOPPED: AtomicBool = AtomicBool::new(false);

/// Handler of Ctrl-C: while cases are diagnosed the first one removes their folders, any other ends
/// the program.
pub fn on_ctrl_c() {
    if STOPPED.swap(true, SeqCst) || !RUNNING.load(SeqCst) {
        clean_up_and_exit(130);
    }
}

/// Whether Ctrl-C asked to stop.
pub fn is_stopped() -> bool {
    STOPPED.load(SeqCst)
}

/// Diagnoses every case of a folder that has no answer yet; returns how many are answered, of how
/// many.
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
    let progress = Progress::new("diagnosing", waiting.len());
    let jobs = options.jobs.unwrap_or_else(cores).clamp(1, waiting.len().max(1));
    shared_out(jobs, waiting.len(), |at| {
        let (name, path) = waiting[at];
        ensure!(!is_stopped(), "interrupted");
        answer(&program, path, jobs > 1, options).with_context(|| name.clone())?;
        progress.step();
        Ok(())
    })?;
    RUNNING.store(false, SeqCst);
    Ok((all.iter().filter(|(_, path)| path.join(ANSWER).is_file()).count(), all.len()))
}

/// Diagnoses one case in a process that is given a copy of its data and nothing else.
fn answer(program: &Path, case: &Path, is_alone: bool, options: &RunOptions) -> anyhow::Result<()> {
    let room = Room::of(case, &[ANSWER, REFUSAL, HINT])?;
    let mut command = room.command(program);
    command.args(["diagnose", ".", &format!("--json={ANSWER}"), "--no-next"]);
    for name in struck(case)? {
        command.args(["--without", &name]);
    }
    if is_alone {
        command.env("RAYON_NUM_THREADS", "1");
    }
    if !options.no_baselines {
        command.arg("--baselines");
    }
    let output =
        command.output().with_context(|| format!("{}: it cannot be run", program.display()))?;
    let (file, text) = if output.status.success() {
        (ANSWER, room.read(ANSWER)?)
    } else {
        let why = String::from_utf8_lossy(&output.stderr).into_owned();
        ensure!(output.status.code() == Some(1), "the diagnosis broke off: {why}");
        // a refusal is an answer, too: it is scored as none
        (REFUSAL, why)
    };
    room.close()?;
    Ok(write_whole(case.join(file), |out| out.write_all(text.as_bytes()))?)
}

/// Effects that a case's `hint.toml` takes out of the catalogue.
fn struck(case: &Path) -> anyhow::Result<Vec<String>> {
    let path = case.join(HINT);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let hint: Hint = toml::from_str(&text).with_context(|| path.display().to_string())?;
    Ok(hint.without)
}

#[derive(serde::Deserialize)]
struct Hint {
    #[serde(default)]
    without: Vec<String>,
}
