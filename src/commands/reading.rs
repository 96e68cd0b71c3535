//! How recordings are read: what the commands that take them share.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use stretch_data::{DataError, DataSet, Split, Trial};
use stretch_recording::{ReadOptions, Recording, RecordingError, TimeUnit, tidy_column};

use super::shared::progress;
use crate::display::{detail, warn};

/// Options for recordings that do not say all of themselves.
#[derive(clap::Args)]
pub(crate) struct Recorded {
    /// Column of the time; its last part may be ms, us or ns
    #[arg(long, default_value = "time_s", value_name = "COL")]
    time: String,
    /// What the time counts, whatever its name says
    #[arg(long, value_enum, value_name = "UNIT")]
    time_unit: Option<Unit>,
    /// Names of the columns where the recording has none: time_s,bridge_v,...
    #[arg(long = "columns", value_name = "NAMES", value_delimiter = ',')]
    named: Option<Vec<String>>,
    /// Samples a second of a recording without any time
    #[arg(long, value_name = "HZ", value_parser = rate)]
    sample_rate: Option<f64>,
    /// Bring the recording onto an even grid of so many samples a second [default: as it was
    /// recorded; several clocks to the fastest]
    #[arg(long, value_name = "HZ", value_parser = rate)]
    grid: Option<f64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum Unit {
    S,
    Ms,
    Us,
    Ns,
}

fn rate(text: &str) -> Result<f64, String> {
    let rate_hz = text.parse::<f64>().ok().filter(|hz| (1e-3..=1e7).contains(hz));
    rate_hz.ok_or_else(|| format!("\"{text}\" is not a rate between 1e-3 and 1e7 Hz"))
}

/// The name of a column as recordings are read: `Pos (mm)` is pos_mm.
pub(crate) fn column(name: &str) -> Result<String, std::convert::Infallible> {
    Ok(tidy_column(name))
}

/// Names of columns with commas, each as recordings are read.
pub(crate) fn columns(names: &str) -> Result<String, std::convert::Infallible> {
    Ok(names.split(',').map(tidy_column).collect::<Vec<_>>().join(","))
}

impl Recorded {
    /// What is asked of each recording.
    pub(crate) fn options(&self) -> ReadOptions {
        let mut options = ReadOptions::new().time(&self.time);
        if let Some(unit) = self.time_unit {
            options = options.time_unit(match unit {
                Unit::S => TimeUnit::Seconds,
                Unit::Ms => TimeUnit::Milliseconds,
                Unit::Us => TimeUnit::Microseconds,
                Unit::Ns => TimeUnit::Nanoseconds,
            });
        }
        if let Some(names) = &self.named {
            options = options.columns(names.iter().map(|name| name.trim()));
        }
        if let Some(rate_hz) = self.sample_rate {
            options = options.sample_rate_hz(rate_hz);
        }
        match self.grid {
            Some(rate_hz) => options.grid_hz(rate_hz),
            None => options,
        }
    }
}

/// Reads a recording, `-` being standard input, and reports on standard error what had to be changed.
pub(crate) fn read_recording(path: &Path, options: &ReadOptions) -> Result<Trial, RecordingError> {
    Ok(with_notes_printed(Recording::read(path, options)?))
}

/// The trial of a recording, after its notes were printed.
pub(crate) fn with_notes_printed(Recording { trial, notes }: Recording) -> Trial {
    for note in notes {
        warn(format!("note: {}: {note}", trial.name));
    }
    let names: Vec<&str> = trial.channels.iter().map(|channel| channel.name.as_str()).collect();
    let rate = trial.rate_hz().map_or(String::new(), |hz| format!(", {hz:.4} a second"));
    detail(format!("read {}: {} samples of {}{rate}", trial.name, trial.len(), names.join(", ")));
    trial
}

/// An error of reading, with what to do where a column that is needed has another name.
pub(crate) fn with_columns_to_name(error: anyhow::Error, what_to_do: &str) -> anyhow::Error {
    let missing = match error.downcast_ref() {
        Some(RecordingError::Data(missing @ DataError::MissingColumn { .. })) => {
            missing.to_string()
        }
        _ => return error,
    };
    anyhow::anyhow!("{missing}; {what_to_do}")
}

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
                trials.push(with_notes_printed(Recording::of_entry(entry, path, options)?));
            }
            // once: what is wrong is one line of dataset.toml
            let wrong = trials[before..].iter().find_map(|trial| set.rate_mismatch(trial));
            wrong.into_iter().for_each(|note| warn(format!("note: {note}")));
            if trials.len() == before {
                let split = split.name();
                anyhow::bail!(
                    "{}: no trial of the data set has split = \"{split}\"; name files instead",
                    path.display()
                );
            }
        } else {
            trials.push(read_recording(path, options)?);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(trials)
}
