//! Output of the program: lines, tables, and progress.

use std::{
    fmt::Display,
    io::{Write, stdout},
};

use comfy_table::{Table, presets};
use indicatif::{ProgressBar, ProgressStyle};

/// Writes a text and a newline to standard output; the work continues if standard output is closed.
pub fn say(text: impl Display) {
    let _ = writeln!(stdout(), "{text}");
}

/// Returns a progress bar on standard error. It is visible only on a terminal.
pub fn progress(what: &'static str, steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg}: {pos} of {len}");
    let bar = ProgressBar::new(steps as u64).with_message(what);
    // the template is a constant
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Formats a Markdown table with aligned columns.
pub(crate) fn table<const N: usize>(
    head: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN).set_header(head).add_rows(rows);
    table.to_string()
}
