//! Reading of recordings: options and functions shared by the commands.

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use stretch_core::Provenance;
use stretch_data::{DataError, DataSet, Split, Trial};
use stretch_recording::{
    ReadOptions, Recording, RecordingError, TimeColumn, is_format_note, tidy_column,
};

use super::shared::progress;
use crate::display::{detail, warn};

/// Options for recordings that do not say all of themselves.
#[derive(clap::Args)]
pub(crate) struct Recorded {
    /// Time column; COL:ms if in ms; 100hz if there is none
    ///
    /// A unit may follow the column: :s, :ms, :us, :ns, :min, :h or :d. Otherwise the unit comes from the name, as in t_ms, or
    /// from the numbers. A rate such as 100hz replaces the time column, even if there is one. For dates such as 05/01/2024, add
    /// :dmy if the day comes first, or :mdy if the month comes first.
    #[arg(long, default_value = "time_s", value_name = "COL")]
    time: TimeColumn,
    /// Names of the columns if there is no header: time_s,bridge_v
    #[arg(long = "columns", value_name = "NAMES", value_delimiter = ',')]
    named: Option<Vec<String>>,
    #[command(flatten)]
    pub(crate) rows: Rows,
}

/// What becomes of a row that cannot be read.
#[derive(clap::Args)]
pub(crate) struct Rows {
    /// Refuse a recording with a row that cannot be read
    ///
    /// Otherwise such rows are left out with a note, up to one in five.
    #[arg(long)]
    pub(crate) strict: bool,
}

/// Returns the name of a column as the reader normalizes it: `Pos (mm)` becomes pos_mm.
pub(crate) fn column(name: &str) -> Result<String, std::convert::Infallible> {
    Ok(tidy_column(name))
}

/// Returns comma-separated names of columns, each as the reader normalizes it.
pub(crate) fn columns(names: &str) -> Result<String, std::convert::Infallible> {
    Ok(names.split(',').map(tidy_column).collect::<Vec<_>>().join(","))
}

impl Recorded {
    /// Returns the sample rate given on the command line, if there is one, Hz.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        match self.time {
            TimeColumn::Rate(rate_hz) => Some(rate_hz),
            _ => None,
        }
    }

    /// Returns the time column for a calibration file; empty if a usual one was read.
    pub(super) fn stored_time(&self) -> String {
        self.time.stored()
    }

    /// Returns the reading options for a calibration. If no time column is given, the time column is that of the
    /// calibration's trials.
    pub(super) fn options_of(&self, calibrated_on: &Provenance) -> ReadOptions {
        match calibrated_on.time().parse::<TimeColumn>() {
            Ok(time)
                if self.time.stored().is_empty()
                    && self.rate_hz().is_none()
                    && !calibrated_on.time().is_empty() =>
            {
                self.with_time(&time).or_usual_time()
            }
            _ => self.options(),
        }
    }

    /// Returns the reading options.
    pub(crate) fn options(&self) -> ReadOptions {
        self.with_time(&self.time)
    }

    fn with_time(&self, time: &TimeColumn) -> ReadOptions {
        let options = time.options().strict(self.rows.strict);
        match &self.named {
            Some(names) => options.columns(names.iter().map(|name| name.trim())),
            None => options,
        }
    }
}

/// Reads a recording (`-` is standard input) and prints notes on changes to standard error.
pub(crate) fn read_recording(path: &Path, options: &ReadOptions) -> Result<Trial, RecordingError> {
    Ok(with_notes_printed(Recording::read(path, options)?))
}

/// Prints a note on a recording; with `-v` only, if the note describes its format and nothing else.
pub(crate) fn print_note(name: &str, note: &str) {
    match is_format_note(note) {
        true => detail(format!("note: {name}: {note}")),
        false => warn(format!("note: {name}: {note}")),
    }
}

/// Prints the notes of a recording and returns its trial.
pub(crate) fn with_notes_printed(Recording { trial, notes }: Recording) -> Trial {
    notes.iter().for_each(|note| print_note(&trial.name, note));
    let names: Vec<&str> = trial.channels.iter().map(|channel| channel.name.as_str()).collect();
    let rate = trial.rate_hz().filter(|_| !trial.counts_rows());
    let rate = rate.map_or(String::new(), |hz| format!(", {hz:.4} per second"));
    detail(format!("read {}: {} samples of {}{rate}", trial.name, trial.len(), names.join(", ")));
    trial
}

/// Adds advice to an error about a missing column.
pub(crate) fn with_columns_to_name(error: anyhow::Error, what_to_do: &str) -> anyhow::Error {
    let missing = match error.downcast_ref() {
        Some(RecordingError::Data(missing @ DataError::MissingColumn { .. })) => {
            missing.to_string()
        }
        _ => return error,
    };
    anyhow::anyhow!("{missing}; {what_to_do}")
}

/// Reads trials from files. For a folder with a `dataset.toml`, reads its trials of the given
/// split.
pub(crate) fn read_trials(
    paths: &[PathBuf],
    split: Split,
    options: &ReadOptions,
) -> anyhow::Result<Vec<Trial>> {
    let mut trials = Vec::new();
    // Pipes and standard input are read in order and one by one, because each can be read only
    // once.
    let known: Vec<(&PathBuf, bool)> = paths.iter().map(|path| (path, path.is_file())).collect();
    for group in known.chunk_by(|(_, a), (_, b)| *a && *b) {
        let folder = group[0].0;
        if !folder.is_dir() {
            trials.extend(read_all(group, |(path, _)| Recording::read(path, options))?);
            continue;
        }
        let set = DataSet::read(folder)?;
        let entries: Vec<_> = set.entries(split).collect();
        if entries.is_empty() {
            anyhow::bail!(
                "{}: no trial of the data set has split = \"{split}\"; name files instead",
                folder.display()
            );
        }
        let (read, all) = (entries.len(), set.trials.len());
        if read < all {
            warn(format!(
                "note: {}: {read} of its {all} trials are used, those with split = \"{split}\"",
                folder.display()
            ));
        }
        let own = read_all(&entries, |entry| Recording::of_entry(entry, folder, options))?;
        // Reported once, because the error is in one line of dataset.toml.
        let wrong = own.iter().find_map(|trial| set.rate_mismatch(trial));
        wrong.into_iter().for_each(|note| warn(format!("note: {note}")));
        trials.extend(own);
    }
    Ok(trials)
}

/// Number of recordings that are read before their notes are printed. After an error, reading stops
/// at the end of the batch.
const BATCH: usize = 256;

/// Reads recordings on all cores. Notes and the first error are the same as if the recordings were read in order.
fn read_all<T: Sync>(
    items: &[T],
    read: impl Fn(&T) -> Result<Recording, RecordingError> + Send + Sync,
) -> Result<Vec<Trial>, RecordingError> {
    let bar = progress("reading", items.len() as u64);
    let mut trials = Vec::new();
    for batch in items.chunks(BATCH) {
        let read: Vec<_> = batch.par_iter().map(&read).inspect(|_| bar.inc(1)).collect();
        for recording in read {
            trials.push(with_notes_printed(recording?));
        }
    }
    bar.finish_and_clear();
    Ok(trials)
}
