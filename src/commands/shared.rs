//! What the subcommands share: reading trials, progress, writing.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use indicatif::{ProgressBar, ProgressStyle};
use stretch_data::{DataSet, ReadOptions, Split, Trial};

pub(crate) use crate::display::{say, say_json};

/// Reads trials from files; a folder with a `dataset.toml` stands for its
/// trials of that split.
pub(crate) fn read_trials(
    paths: &[PathBuf],
    split: Split,
    options: &ReadOptions,
) -> anyhow::Result<Vec<Trial>> {
    let bar = progress("reading", paths.len() as u64);
    let mut trials = Vec::new();
    for path in paths {
        if path.is_dir() {
            let set = DataSet::read(path)?;
            let before = trials.len();
            for entry in set.entries(split) {
                trials.push(entry.load(path, options)?);
            }
            if trials.len() == before {
                let split = split.name();
                anyhow::bail!(
                    "{}: no trial of the data set has split = \"{split}\"; name files instead",
                    path.display()
                );
            }
        } else {
            trials.push(Trial::read(path, options)?);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(trials)
}

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

/// Writes a text file, whole or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(stretch_data::write_whole(path, |out| out.write_all(text.as_bytes()))?)
}

/// A file's name without folder and ending, for a table.
pub(crate) fn short_name(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
