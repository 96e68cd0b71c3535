//! The trials of a data set, each read as a recording.

use std::path::Path;

use stretch_data::{DataSet, SessionTrial, TrialEntry};

use crate::{ReadOptions, Recording, RecordingError};

impl Recording {
    /// Reads a trial of a data set from the folder of the data set. The file can have any supported format.
    ///
    /// # Errors
    /// The errors of [`Recording::read`], and an error if the file differs from the one with which the data set was
    /// written.
    pub fn of_entry(
        entry: &TrialEntry,
        folder: impl AsRef<Path>,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        entry.check_file(&folder)?;
        let mut recording = Self::read(folder.as_ref().join(&entry.file), options)?;
        recording.trial.name.clone_from(&entry.file);
        Ok(recording)
    }

    /// Reads a trial of a data set from the bytes of its file, without a folder.
    ///
    /// # Errors
    /// The errors of [`Recording::of_entry`].
    pub fn of_bytes(
        entry: &TrialEntry,
        bytes: &[u8],
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        entry.check_bytes(bytes)?;
        Self::from_reader(bytes, &entry.file, options)
    }

    /// Reads every trial of a data set from its folder.
    ///
    /// # Errors
    /// The errors of [`Recording::of_entry`].
    pub fn session(
        set: &DataSet,
        folder: impl AsRef<Path>,
        options: &ReadOptions,
    ) -> Result<Vec<SessionTrial>, RecordingError> {
        Self::session_by(set, |entry| Self::of_entry(entry, &folder, options))
    }

    /// Reads every trial of a data set with the function `read`, for files that are not in a folder.
    ///
    /// # Errors
    /// The errors that `read` returns.
    ///
    /// ```
    /// use stretch_data::{DataSet, Split};
    /// use stretch_recording::{ReadOptions, Recording};
    /// let text = "name = 'b'\nrate_hz = 100\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'test'";
    /// let set = DataSet::parse("dataset.toml", text)?;
    /// let bytes = b"time_s,bridge_v\n0,1.5\n0.01,1.6\n";
    /// let trials = Recording::session_by(&set, |entry| Recording::of_bytes(entry, bytes, &ReadOptions::new()))?;
    /// assert_eq!((trials[0].trial.name.as_str(), trials[0].split), ("a.csv", Split::Test));
    /// # Ok::<(), stretch_recording::RecordingError>(())
    /// ```
    pub fn session_by<E>(
        set: &DataSet,
        mut read: impl FnMut(&TrialEntry) -> Result<Self, E>,
    ) -> Result<Vec<SessionTrial>, E> {
        let mut is_told = false;
        let load = |entry: &TrialEntry| {
            let mut recording = read(entry)?;
            // Report a wrong rate once for all trials, because its cause is one line of dataset.toml.
            let told = set.rate_mismatch(&recording.trial).filter(|_| !is_told);
            is_told |= told.is_some();
            recording.notes.extend(told);
            Ok(SessionTrial {
                kind: entry.kind,
                start_s: entry.start_s,
                split: entry.split,
                ..recording.into()
            })
        };
        set.trials.iter().map(load).collect()
    }
}
