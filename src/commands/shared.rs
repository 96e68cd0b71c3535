//! What the subcommands share: progress, writing.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use stretch_data::files::{FileError, Outputs};

use crate::display::shows_progress;
pub(crate) use crate::display::{detail, give_stdout, say, say_as_is, say_first, tell};

/// A progress bar on standard error: seen on a terminal only.
pub(crate) fn progress(what: &'static str, steps: u64) -> ProgressBar {
    let bar = ProgressBar::new(steps).with_message(what);
    // the template is a constant: were it wrong, the plain bar is shown
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {elapsed}") {
        bar.set_style(style);
    }
    ticking(bar)
}

/// Seen on a terminal only: what goes on, and for how long already.
pub(crate) fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message("reading");
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
        bar.set_style(style);
    }
    ticking(bar)
}

/// A bar that moves, or one that nobody sees.
fn ticking(bar: ProgressBar) -> ProgressBar {
    if shows_progress() {
        bar.enable_steady_tick(Duration::from_millis(150));
    } else {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

/// Says how a folder that is in the way can be replaced.
pub(crate) fn or_force(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref::<FileError>() {
        Some(FileError::Exists { .. }) => anyhow::anyhow!(
            "{error}, or --force: files of the same name are then replaced, your own are kept"
        ),
        _ => error,
    }
}

/// An error with the files that it came of, where it does not name them itself.
pub(crate) fn of_files(error: impl Into<anyhow::Error>, paths: &[PathBuf]) -> anyhow::Error {
    let (error, shown) = (error.into(), |path: &Path| path.display().to_string());
    let message = format!("{error:#}");
    let is_named = |path: &PathBuf| {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        message.contains(&*name)
    };
    match paths {
        [] => error,
        paths if paths.iter().any(is_named) => error,
        [path] => error.context(shown(path)),
        [first, others @ ..] => {
            error.context(format!("{} and {} more", shown(first), others.len()))
        }
    }
}

/// A text file among what one command writes.
pub(crate) fn stage_text(outputs: &mut Outputs, path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(outputs.file(path, |out| out.write_all(text.as_bytes()))?)
}

/// Writes a text file, whole or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(stretch_data::files::write_whole(path, |out| out.write_all(text.as_bytes()))?)
}

/// A file's name without folder and ending, for a table.
pub(crate) fn short_name(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
