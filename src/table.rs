//! Tables on a terminal.

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Table, Width, presets};

pub(crate) use stretch_report::number;

use crate::display::columns;

/// A cell of up to this number of characters is not broken if it needs at most a third of the line. Such cells are
/// numbers, intervals or names.
const WHOLE: usize = 24;
/// Characters between two cells.
const AROUND: usize = 3;

/// Formats a table with a header line. The first column is aligned to the left, the others to the
/// right.
///
/// The table is at most as wide as the terminal. Long texts break between words. Columns that do
/// not fit are put into a further table below, which repeats the first column. Nothing is left out.
pub(crate) fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let rows: Vec<Vec<String>> = rows.into_iter().collect();
    fitted(header, &rows, columns())
}

fn fitted(header: &[&str], rows: &[Vec<String>], width: usize) -> String {
    let whole = WHOLE.min(width / 3);
    let least: Vec<usize> = (0..header.len()).map(|i| least(header[i], rows, i, whole)).collect();
    let Some((&first, others)) = least.split_first() else { return String::new() };
    let mut groups: Vec<Vec<usize>> = vec![Vec::new()];
    let mut used = 1 + first + AROUND;
    for (i, own) in others.iter().enumerate() {
        let is_full = used + own + AROUND > width;
        if is_full && groups.last().is_some_and(|group| !group.is_empty()) {
            groups.push(Vec::new());
            used = 1 + first + AROUND;
        }
        used += own + AROUND;
        groups.last_mut().into_iter().for_each(|group| group.push(i + 1));
    }
    let parts = groups.iter().map(|group| some_columns(header, rows, group, &least, width));
    parts.collect::<Vec<_>>().join("\n")
}

/// Formats a table of the first column and a group of others.
fn some_columns(
    header: &[&str],
    rows: &[Vec<String>],
    group: &[usize],
    least: &[usize],
    width: usize,
) -> String {
    let columns: Vec<usize> = std::iter::once(0).chain(group.iter().copied()).collect();
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN);
    table.set_content_arrangement(ContentArrangement::Dynamic);
    table.set_width(u16::try_from(width).unwrap_or(u16::MAX));
    table.set_header(columns.iter().map(|&i| header[i]));
    for row in rows {
        table.add_row(columns.iter().map(|&i| row.get(i).map_or("", String::as_str)));
    }
    for (at, column) in table.column_iter_mut().enumerate() {
        let room = u16::try_from(least[columns[at]] + 2).unwrap_or(u16::MAX);
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(room)));
        if at > 0 {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table.to_string()
}

/// Returns the minimum width of a column: its longest word, or its longest unbroken cell.
fn least(head: &str, rows: &[Vec<String>], column: usize, whole: usize) -> usize {
    let longest_word = |text: &str| text.split(' ').map(length).max().unwrap_or(0);
    let of_cell = |text: &String| longest_word(text).max(length(text).min(whole));
    let cells = rows.iter().filter_map(|row| row.get(column)).map(of_cell).max();
    longest_word(head).max(cells.unwrap_or(0)).max(1)
}

fn length(text: &str) -> usize {
    text.chars().count()
}

/// Formats a table of a report with its caption.
pub(crate) fn table_text(report: &stretch_report::Table) -> String {
    format!("{}:\n{}", unbroken(&report.caption), drawn(report))
}

/// Formats a table of a report without its caption.
pub(crate) fn drawn(report: &stretch_report::Table) -> String {
    let head: Vec<&str> = report.head.iter().map(String::as_str).collect();
    let rows = report.rows.iter().map(|row| row.iter().map(|cell| unbroken(cell)).collect());
    table(&head, rows)
}

/// Replaces the non-breaking spaces of a report by plain ones.
pub(crate) fn unbroken(text: &str) -> String {
    text.replace('\u{a0}', " ")
}

/// Formats a number that may be missing.
pub(crate) fn maybe(x: Option<f64>) -> String {
    x.map_or_else(|| "-".to_owned(), number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_is_too_wide_goes_on_below() {
        let rest = ["0.001368", "12.05 .. 376.8", "-", "a long remark of many words here"];
        let row = |name: &str| [name].into_iter().chain(rest).map(str::to_owned).collect();
        let rows: Vec<Vec<String>> = ["first", "second"].map(row).to_vec();
        let header = ["name", "value", "95 % interval", "mark", "what there is to say"];
        for width in [30, 40, 60, 80, 100] {
            let shown = fitted(&header, &rows, width);
            assert!(shown.lines().all(|line| length(line) <= width), "{width}:\n{shown}");
            for cell in ["0.001368", "12.05", "376.8", "second", "remark", "words"] {
                assert!(shown.contains(cell), "{width}: {cell} is lost:\n{shown}");
            }
        }
        assert_eq!(fitted(&header, &rows, 100).lines().count(), 4);
        assert!(fitted(&header, &rows, 40).matches("first").count() > 1);
    }
}
