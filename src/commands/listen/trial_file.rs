//! The recorded trial: each sample is written to disk as one line when it arrives.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Read, Seek, Write},
    path::{Path, PathBuf},
};

use stretch_calibrate::LinkSample;

/// A trial file that grows by complete lines. It is removed on drop if it has no row.
pub(crate) struct TrialFile {
    path: PathBuf,
    file: File,
    line: Vec<u8>,
    /// Length of the complete lines, bytes.
    whole: u64,
    rows: u64,
}

impl TrialFile {
    /// Creates the file. An existing file is refused, unless it contains only the header of a
    /// recording that was killed before its first row.
    pub(crate) fn create(path: &Path, header: &str) -> io::Result<Self> {
        let file = match OpenOptions::new().write(true).create_new(true).open(path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => without_a_row(path)?
                .ok_or_else(|| {
                    io::Error::other(
                        "it exists, and a recording never overwrites a file; name another file",
                    )
                })?,
            other => other?,
        };
        // If files cannot be locked, two recordings into one file cannot be detected.
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(io::Error::other("another program is recording to it; name another file"));
        }
        file.set_len(0)?;
        let line = header.as_bytes().to_vec();
        let mut recording = Self { path: path.to_owned(), file, line, whole: 0, rows: 0 };
        recording.write()?;
        Ok(recording)
    }

    /// Returns the number of rows so far.
    pub(crate) fn rows(&self) -> u64 {
        self.rows
    }

    /// Writes a sample with a single call, so that a killed program leaves complete lines. A sample
    /// without a signal is not written. It remains a gap in time.
    pub(crate) fn push(&mut self, sample: &LinkSample) -> io::Result<()> {
        if sample.signal.is_none() {
            return Ok(());
        }
        self.line.clear();
        sample.push_line(&mut self.line);
        self.write()?;
        self.rows += 1;
        Ok(())
    }

    fn write(&mut self) -> io::Result<()> {
        let written = self.file.write_all(&self.line);
        match written {
            Ok(()) => self.whole += self.line.len() as u64,
            // A full disk may have accepted a part of the line, which is then cut off. The first
            // error is reported, not an error of the truncation.
            Err(_) => drop(self.file.set_len(self.whole)),
        }
        written
    }

    pub(crate) fn finish(self) -> io::Result<()> {
        self.file.sync_all()
    }
}

/// Opens a file that contains nothing but a header of this program, positioned at its start.
fn without_a_row(path: &Path) -> io::Result<Option<File>> {
    // Opening a pipe would wait for its reader.
    if !fs::symlink_metadata(path)?.is_file() {
        return Ok(None);
    }
    let mut file = OpenOptions::new().read(true).write(true).open(path)?;
    let mut text = String::new();
    let longest = 4096;
    if (&mut file).take(longest).read_to_string(&mut text).is_err() {
        return Ok(None);
    }
    let is_header = text.starts_with("time_s,") && text.contains(",adc_code,");
    let has_a_row = text.trim_end_matches('\n').contains('\n') || text.len() as u64 == longest;
    if has_a_row || !(is_header || text.is_empty()) {
        return Ok(None);
    }
    file.rewind()?;
    Ok(Some(file))
}

impl Drop for TrialFile {
    /// Removes a file that contains only a header, because it would block the next attempt.
    fn drop(&mut self) {
        if self.rows == 0 {
            let _ = fs::remove_file(&self.path);
        }
    }
}
