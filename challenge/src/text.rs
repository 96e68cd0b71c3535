//! Output of the program: lines, tables, and progress.

use std::{
    fmt::Display,
    io::{Write, stdout},
};

use indicatif::{ProgressBar, ProgressStyle};

/// Writes a text and a newline to standard output; the work continues if standard output is closed.
pub fn say(text: impl Display) {
    let _ = writeln!(stdout(), "{text}");
}

/// A bar on standard error, only on a terminal.
pub fn progress(what: &'static str, steps: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg}: {pos} of {len}");
    let bar = ProgressBar::new(steps as u64).with_message(what);
    // the template is a constant
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// A text whose Markdown tables have columns of one width each.
///
/// ```
/// let text = "one\n| a | b |\n| --- | --- |\n| long | 1 |\n- two";
/// let aligned = stretch_challenge::aligned(text);
/// assert_eq!(aligned, "one\n| a    | b |\n| ---- | - |\n| long | 1 |\n- two");
/// ```
pub fn aligned(text: &str) -> String {
    let cells = |line: &str| -> Option<Vec<String>> {
        let inside = line.strip_prefix('|')?.strip_suffix('|')?;
        Some(inside.split('|').map(|cell| cell.trim().to_owned()).collect())
    };
    let lines: Vec<&str> = text.lines().collect();
    let tables = lines.chunk_by(|a, b| a.starts_with('|') == b.starts_with('|'));
    let block = |block: &[&str]| match block.iter().map(|line| cells(line)).collect() {
        Some(rows) => table(rows),
        None => block.join("\n"),
    };
    tables.map(block).collect::<Vec<_>>().join("\n")
}

fn table(rows: Vec<Vec<String>>) -> String {
    let is_rule = |cell: &String| cell.starts_with("---");
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let of_column =
        |i: usize| rows.iter().filter_map(move |row| row.get(i)).filter(|c| !is_rule(c));
    let wide = |i: usize| of_column(i).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(wide).collect();
    let cell = |(cell, width): (&String, &usize)| match is_rule(cell) {
        true => "-".repeat(*width),
        false => format!("{cell:width$}"),
    };
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(&widths).map(cell).collect();
        format!("| {} |", cells.join(" | "))
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}
