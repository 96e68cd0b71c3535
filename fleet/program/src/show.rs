//! What is printed, and how far work is.

use std::{
    io::{self, Write},
    time::Duration,
};

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::lake::Refused;

/// Files that are listed one by one.
const MOST_TOLD: usize = 20;

/// Prints a line; a reader that has gone is no error.
pub(crate) fn say(text: impl std::fmt::Display) -> anyhow::Result<()> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e.into()),
        _ => Ok(()),
    }
}

/// Prints JSON.
pub(crate) fn say_json(value: &impl Serialize) -> anyhow::Result<()> {
    say(serde_json::to_string_pretty(value)?)
}

/// Writes a message to standard error, separate from the answer.
pub(crate) fn warn(text: impl std::fmt::Display) {
    // if even this cannot be written, the error cannot be reported
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Says which files were refused, the first of many.
pub(crate) fn warn_of(what: &str, refused: &[Refused]) {
    for Refused { file, why } in refused.iter().take(MOST_TOLD) {
        warn(format!("{what} {file}: {why}"));
    }
    if refused.len() > MOST_TOLD {
        warn(format!("... and {} more", refused.len() - MOST_TOLD));
    }
}

/// A bar on standard error, seen on a terminal only.
pub(crate) fn bar(what: &'static str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(what);
    // the template is a constant; if it were wrong, the plain bar is shown
    if let Ok(style) =
        ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len}, {elapsed} gone, {eta} to go")
    {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}
