//! What the subcommands share: progress, writing.

use std::{path::Path, time::Duration};

use indicatif::{ProgressBar, ProgressStyle};

pub(crate) use crate::display::{give_stdout, say, say_json};

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
