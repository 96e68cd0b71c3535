//! The names of a table's columns.

use stretch_data::{DataError, Place, column_meant, shown};

use crate::{
    ReadOptions, RecordingError,
    clock::{note_on_rate, time_among},
    grid::note,
    options::TIME,
    stamps::looks_like_stamp,
};

/// Names of columns in the file's order; an empty name is a column without one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Header {
    pub(crate) names: Vec<String>,
    pub(crate) delimiter: u8,
    /// Number of columns in each row. A name beyond them is a remark or a column that was not recorded.
    pub(crate) recorded: usize,
}

impl Header {
    /// Returns the names of columns from the cells of a header line. A second column with the name `X` becomes `X.1`,
    /// with a note. The first becomes `X.0` if the options ask for that name.
    ///
    /// # Errors
    /// A name contains a control character, or two columns have the same requested name.
    pub(crate) fn named(
        file: &str,
        row: u64,
        cells: &[String],
        options: &ReadOptions,
        notes: &mut Vec<String>,
    ) -> Result<Vec<String>, RecordingError> {
        let mut names: Vec<String> = cells.to_vec();
        let (mut renamed, asked) = (Vec::new(), options.asked());
        for (column, cell) in cells.iter().enumerate() {
            if cell.contains(char::is_control) {
                let (column, value) = ((column + 1).to_string(), shown(cell.as_bytes()));
                let problem = format!(
                    "the name \"{value}\" holds a control character; if the lines end in CR alone, save the file with LF"
                );
                let at = Place { file: file.to_owned(), row, column };
                return Err(RecordingError::unusable(at, problem));
            }
            // A serial monitor also writes the time of day before the header line.
            if looks_like_stamp(cell) {
                names[column] = "stamp".to_owned();
            }
            let before = cells[..column].iter().filter(|name| *name == cell).count();
            let first_asked = || asked.iter().any(|name| **name == format!("{cell}.0"));
            let is_twice = before > 0 || (cells[column + 1..].contains(cell) && first_asked());
            if cell.is_empty() || !is_twice {
                continue;
            }
            // If several columns have the default name of the time, the first of them is the time.
            if asked.contains(&cell) && cell != TIME {
                let problem = format!(
                    "the header names column {cell} twice; ask for {cell}.0 or {cell}.1, the first and the second of them"
                );
                return Err(RecordingError::unusable(file, problem));
            }
            names[column] = format!("{cell}.{before}");
            renamed.push(format!("{cell} (column {}) -> {cell}.{before}", column + 1));
        }
        note(notes, "columns with the same name are numbered", &renamed);
        Ok(names)
    }

    /// Returns the index of the time column. If samples are counted instead, also returns the sample rate and adds a
    /// note.
    pub(crate) fn time(
        &self,
        file: &str,
        stated: Option<(f64, String)>,
        options: &ReadOptions,
        notes: &mut Vec<String>,
    ) -> Result<(Option<usize>, Option<f64>), RecordingError> {
        // A name without numbers below it is not the name of the time. It may be a remark after the last column.
        let time = time_among(&self.names[..self.recorded], options);
        let counted = options.counted(time.is_some(), stated);
        if time.is_none() && counted.is_none() {
            return Err(RecordingError::missing_time(file, &options.time, &self.names));
        }
        let rate_hz = counted.map(|(rate_hz, by)| {
            notes.push(note_on_rate(time.map(|i| &*self.names[i]), rate_hz, &by));
            rate_hz
        });
        Ok((time, rate_hz))
    }

    /// Returns the index of the column that `name` means.
    pub(crate) fn position(&self, file: &str, name: &str) -> Result<usize, RecordingError> {
        let meant = column_meant(name, self.names.iter().map(String::as_str));
        let position = meant.and_then(|name| self.names.iter().position(|n| n == name));
        position.ok_or_else(|| {
            DataError::missing_column(file, name, self.names.iter().map(String::as_str)).into()
        })
    }

    /// Returns the name of the column at `position` for a message.
    pub(crate) fn label(&self, position: usize) -> String {
        match self.names.get(position) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => (position + 1).to_string(),
        }
    }
}
