//! The recorded trial: each sample is written to disk as one line when it arrives.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Read, Seek, Write},
    path::{Path, PathBuf},
};

use stretch_core::Target;
use stretch_data::push_number;
use stretch_link::{Answer, Frame};
use stretch_receptor::code::{Adc, AdcCode};

use super::Twin;

/// One sample, as shown and recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sample {
    pub time_s: f64,
    /// The signal, in its unit; `None` for a sample that the board did not get.
    pub signal: Option<f64>,
    /// The estimate, in the unit of the reference; `None` if the board withholds it.
    pub estimate: Option<f64>,
    pub frame: Frame,
    /// The target of the calibration, if its file contains it.
    pub target: Option<Target>,
}

impl Sample {
    pub(crate) fn new(time_s: f64, frame: Frame, adc: &Adc, target: Option<Target>) -> Self {
        let estimate = match frame.answer {
            Answer::Reading { thousandths, .. } => Some(f64::from(thousandths) / 1000.0),
            _ => None,
        };
        Self { time_s, signal: adc.volts(AdcCode(frame.code)), estimate, frame, target }
    }

    /// Appends `time_s,signal,code,estimate,branch,domain`; missing values are empty.
    pub(crate) fn push_line(&self, line: &mut Vec<u8>) {
        push_number(line, self.time_s);
        line.push(b',');
        if let Some(signal) = self.signal {
            push_number(line, signal);
        }
        // Writing to memory cannot fail.
        let _ = writeln!(line, ",{},{}", self.frame.code, self.frame.answer.cells(self.target));
    }
}

/// Returns the header of the lines, with the names from the calibration.
pub(crate) fn header(twin: &Twin) -> String {
    let estimate = match twin.unit.as_str() {
        "" => "estimate".to_owned(),
        unit => format!("estimate_{unit}"),
    };
    format!("time_s,{},adc_code,{estimate},branch,domain\n", twin.signal)
}

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
    pub(crate) fn push(&mut self, sample: &Sample) -> io::Result<()> {
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
