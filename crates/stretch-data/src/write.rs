//! Writing of trials to files and streams.

use std::{
    io::{self, Write},
    path::Path,
};

use crate::{Channel, DataError, Trial, files::write_whole};

impl Trial {
    /// Writes the trial to a file, completely or not at all: `time_s`, then the channels.
    ///
    /// Numbers are written with the fewest digits that read back to the same bits.
    ///
    /// # Errors
    /// The errors of [`Trial::check`] and [`write_whole`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), DataError> {
        self.check()?;
        Ok(write_whole(path, |out| self.write_rows(out))?)
    }

    /// Writes the trial to a stream, which should be buffered.
    ///
    /// # Errors
    /// The errors of [`Trial::check`], otherwise [`DataError::File`].
    pub fn write_to(&self, mut out: impl Write) -> Result<(), DataError> {
        self.check()?;
        self.write_rows(&mut out).map_err(|e| DataError::io(&self.name, "write it", e))
    }

    /// Checks that a file can hold the trial: channels as long as the time column, valid and unique
    /// names, finite numbers, increasing time, at least one sample.
    ///
    /// # Errors
    /// [`DataError::Unwritable`], [`DataError::Lengths`], or the error of the first wrong sample.
    pub fn check(&self) -> Result<(), DataError> {
        let fail =
            |problem: String| Err(DataError::Unwritable { name: self.name.clone(), problem });
        if self.time_s.is_empty() {
            return fail("it has no sample".to_owned());
        }
        for (i, Channel { name, .. }) in self.channels.iter().enumerate() {
            if !can_name(name) {
                return fail(format!("{name:?} cannot be the name of a channel"));
            }
            if self.channels[..i].iter().any(|other| other.name == *name) {
                return fail(format!("there are two channels {name}"));
            }
        }
        self.check_samples()
    }

    fn write_rows(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut line = Vec::with_capacity(256);
        line.extend_from_slice(b"time_s");
        for channel in &self.channels {
            line.push(b',');
            push_name(&mut line, &channel.name);
        }
        line.push(b'\n');
        out.write_all(&line)?;
        for (row, &time_s) in self.time_s.iter().enumerate() {
            line.clear();
            push_number(&mut line, time_s);
            for channel in &self.channels {
                line.push(b',');
                push_number(&mut line, channel.values[row]);
            }
            line.push(b'\n');
            out.write_all(&line)?;
        }
        Ok(())
    }
}

/// Appends a number with the fewest digits that read back to the same bits.
///
/// ```
/// let mut line = Vec::new();
/// stretch_data::push_number(&mut line, 0.1);
/// line.push(b',');
/// stretch_data::push_number(&mut line, -1e-300);
/// assert_eq!(line, b"0.1,-1e-300");
/// ```
pub fn push_number(line: &mut Vec<u8>, value: f64) {
    let size = value.abs();
    // Writing to memory cannot fail.
    let _ = if size == 0.0 || (1e-5..1e16).contains(&size) {
        write!(line, "{value}")
    } else {
        write!(line, "{value:e}")
    };
}

/// Appends a name, in quotation marks if it contains separators or leading or trailing spaces.
pub(crate) fn push_name(line: &mut Vec<u8>, name: &str) {
    if name.contains([',', ';', '"']) || name.trim() != name {
        line.push(b'"');
        line.extend_from_slice(name.replace('"', "\"\"").as_bytes());
        line.push(b'"');
    } else {
        line.extend_from_slice(name.as_bytes());
    }
}

/// Whether a channel may have this name: not blank, no control characters, and not `time_s`.
pub fn can_name(name: &str) -> bool {
    !(name.trim().is_empty() || name == "time_s" || name.contains(char::is_control))
}
