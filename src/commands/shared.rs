//! What the subcommands share: progress, printing.

use std::{
    io::Write,
    path::Path,
    sync::atomic::{AtomicBool, Ordering::SeqCst},
    time::Duration,
};

use anyhow::{Context, ensure};
use indicatif::{ProgressBar, ProgressStyle};

/// A progress bar on standard error: seen on a terminal only.
pub(crate) fn progress(what: &'static str, steps: u64) -> ProgressBar {
    bar(what, steps, "{msg} [{bar:30}] {pos}/{len} {elapsed}")
}

/// One that says how long it will still take.
pub(crate) fn steps(what: &'static str, count: usize) -> ProgressBar {
    bar(what, count as u64, "{msg} [{bar:30}] {pos}/{len}, {elapsed} gone, {eta} to go")
}

fn bar(what: &'static str, steps: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::new(steps).with_message(what);
    // the template is a constant: were it wrong, the plain bar is shown
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// Whether a file goes to standard output, where nothing else may then stand.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Gives standard output to the one of some files that is called `-`.
pub(crate) fn give_stdout<'a>(
    files: impl IntoIterator<Item = Option<&'a Path>>,
) -> anyhow::Result<()> {
    let count = files.into_iter().flatten().filter(|path| path.as_os_str() == "-").count();
    ensure!(count < 2, "two files cannot go to standard output; name one of them");
    TAKEN.fetch_or(count == 1, SeqCst);
    Ok(())
}

/// Prints a text and a line end to standard output, to standard error where a file goes there; a reader that has gone
/// is an error like any other.
pub(crate) fn say(text: impl std::fmt::Display) -> anyhow::Result<()> {
    if TAKEN.load(SeqCst) {
        return writeln!(std::io::stderr().lock(), "{text}").context("standard error");
    }
    writeln!(std::io::stdout().lock(), "{text}").context("standard output")?;
    Ok(())
}

/// Prints a value as JSON.
pub(crate) fn say_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    say(serde_json::to_string_pretty(value)?)
}

/// Writes a text file, whole or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(stretch_data::write_whole(path, |out| out.write_all(text.as_bytes()))?)
}

/// A file's name without folder and ending, for a table.
pub(crate) fn short_name(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
