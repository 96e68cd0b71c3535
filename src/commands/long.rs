//! Logs that are too long to be held at once.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use stretch_calibrate::{CalibrateError, Calibrated, LONGEST, Options, calibrate_long};
use stretch_data::{DataSet, Split, Trial};
use stretch_recording::{ReadOptions, Recording, RecordingError};

/// Values of all columns that are held at once.
const MOST_VALUES: usize = 4_000_000;
/// Most rows of a log that is held as a whole for a model that needs that; at a hundred bytes a row, a gigabyte.
const MOST_ROWS: u64 = 10_000_000;

/// Files that are read block by block, as often as it takes.
#[derive(Clone)]
pub(super) struct Long {
    paths: Vec<PathBuf>,
    names: Vec<String>,
    columns: ReadOptions,
    rows: usize,
}

impl Long {
    /// The trials, where they are longer than what is held at once and `is_plain` says that they need not be; none for
    /// shorter ones, and for what is no table of text or can be read only once.
    ///
    /// # Errors
    /// Files that cannot be read; a log that is too long for a model that needs the whole of it.
    pub(super) fn of(
        asked: &[PathBuf],
        columns: &ReadOptions,
        is_plain: bool,
    ) -> anyhow::Result<Option<Self>> {
        let paths = files(asked)?;
        let most = if is_plain { LONGEST } else { MOST_ROWS };
        let mut rows = 0;
        for path in &paths {
            match Recording::lines_of(path, most + 1)? {
                Some(lines) => rows += lines,
                None => return Ok(None),
            }
        }
        // so many lines are less rows by a header
        if rows <= most {
            return Ok(None);
        }
        ensure!(
            is_plain,
            "these are more than {MOST_ROWS} rows, too many for what looks at the whole log at once; fit a line or a \
             surface by least squares (--model poly13) to one named signal, or give fewer rows"
        );
        let name = |path: &PathBuf| {
            path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
        };
        let names = paths.iter().map(name).collect();
        let mut long = Self { paths, names, columns: columns.clone(), rows: 1000 };
        let mut width = 1;
        long.first(&long.paths[0], &mut |trial| width = 1 + trial.channels.len())?;
        long.rows = (MOST_VALUES / width).max(1000);
        Ok(Some(long))
    }

    /// The first block of each trial: what pictures are drawn of, and what a report is judged on.
    pub(super) fn beginnings(&self) -> anyhow::Result<Vec<Trial>> {
        let mut all = Vec::new();
        // together not more than one block
        let rows = (self.rows / self.paths.len()).max(1000);
        let short = Self { rows, ..self.clone() };
        for path in &self.paths {
            short.first(path, &mut |trial| all.push(trial))?;
        }
        Ok(all)
    }

    /// The first block of a trial.
    fn first(&self, path: &Path, take: &mut dyn FnMut(Trial)) -> anyhow::Result<()> {
        let mut first = None;
        let read = Recording::read_blocks(path, &self.columns, self.rows, &mut |trial| {
            first = Some(trial);
            Err(Stop::Own(()))
        });
        match (first, read) {
            (Some(trial), _) => take(trial),
            (None, Err(Stop::Read(error))) => return Err(error.into()),
            (None, _) => {}
        }
        Ok(())
    }

    /// Fits what `options` ask for.
    ///
    /// # Errors
    /// As [`calibrate_long`].
    pub(super) fn calibrate(&self, options: &Options) -> Result<Calibrated, CalibrateError> {
        let log = |take: &mut dyn FnMut(usize, Trial) -> Result<(), CalibrateError>| {
            self.paths.iter().enumerate().try_for_each(|(trial, path)| {
                Recording::read_blocks(path, &self.columns, self.rows, &mut |mut block| {
                    block.channels.retain(|channel| {
                        channel.name == options.signal || channel.name == options.reference
                    });
                    take(trial, block).map_err(Stop::Own)
                })
                .map(drop)
                .map_err(|stop| match stop {
                    Stop::Own(error) => error,
                    Stop::Read(error) => CalibrateError::Log(error.into()),
                })
            })
        };
        calibrate_long(&self.names, &log, options)
    }
}

/// Why a file is not read on.
enum Stop<E> {
    Read(RecordingError),
    Own(E),
}

impl<E> From<RecordingError> for Stop<E> {
    fn from(error: RecordingError) -> Self {
        Self::Read(error)
    }
}

/// The files; a folder stands for its fit trials.
fn files(asked: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for path in asked {
        if path.is_dir() {
            let set = DataSet::read(path)?;
            all.extend(set.entries(Split::Fit).map(|entry| path.join(&entry.file)));
        } else {
            all.push(path.clone());
        }
    }
    Ok(all)
}
