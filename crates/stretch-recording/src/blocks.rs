//! A recording in blocks: logs that are longer than what may be held at once.

use std::{
    fs::File,
    io::{Cursor, Read},
    path::Path,
};

use stretch_data::{Channel, Trial};

use crate::{
    ReadOptions, Recording, RecordingError, clock, grid, read::episode, sniff, sniff::Format, text,
};

impl Recording {
    /// Reads a recording in blocks of at most `rows` rows, in the order of time, and gives the notes on all of it.
    ///
    /// Of a table of text, packed with gzip or not, one block is held at a time. Any other format is read whole
    /// and given in blocks.
    ///
    /// # Errors
    /// As [`Recording::read`], and those of `give`.
    ///
    /// ```
    /// use stretch_recording::{ReadOptions, Recording, RecordingError};
    /// # let folder = tempfile::tempdir()?;
    /// let path = folder.path().join("log.csv");
    /// std::fs::write(&path, "time_s,bridge_v\n0,1.5\n0.01,1.6\n0.02,1.7\n")?;
    /// let mut lengths = Vec::new();
    /// Recording::read_blocks(&path, &ReadOptions::new(), 2, &mut |block| {
    ///     lengths.push(block.len());
    ///     Ok::<(), RecordingError>(())
    /// })?;
    /// assert_eq!(lengths, [2, 1]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn read_blocks<E: From<RecordingError>>(
        path: impl AsRef<Path>,
        options: &ReadOptions,
        rows: usize,
        give: &mut dyn FnMut(Trial) -> Result<(), E>,
    ) -> Result<Vec<String>, E> {
        let path = path.as_ref();
        let rows = rows.max(1);
        let Some((mut reader, file)) = table(path)? else {
            let whole = Self::read(path, options)?;
            (0..whole.trial.len()).step_by(rows).try_for_each(|from| {
                give(part(&whole.trial, from, whole.trial.len().min(from + rows)))
            })?;
            return Ok(whole.notes);
        };
        let name = path.file_name().map_or_else(|| file.clone(), |n| n.to_string_lossy().into());
        let mut give = |trial: Trial, time: &str| {
            clock::check(&trial, time, options)?;
            let trial = match options.grid_hz {
                None => trial,
                Some(hz) => grid::resampled(Self { trial, notes: Vec::new() }, hz)?.trial,
            };
            give(Trial { name: name.clone(), ..trial })
        };
        let (rest, time) = text::read_blocks(&mut reader, &file, options, rows, &mut give)?;
        if !rest.trial.is_empty() {
            give(rest.trial, &time)?;
        }
        Ok(rest.notes)
    }

    /// Lines of a file that is a table of text, packed with gzip or not, counted up to `most`; none for what is no such
    /// file, or can be read only once.
    ///
    /// # Errors
    /// A file that cannot be read..
    pub fn lines_of(path: impl AsRef<Path>, most: u64) -> Result<Option<u64>, RecordingError> {
        let path = path.as_ref();
        if !path.is_file() {
            return Ok(None);
        }
        let Some((mut reader, file)) = table(path)? else { return Ok(None) };
        let (mut buffer, mut lines) = (vec![0; 256 * 1024], 0);
        while lines < most {
            let read =
                reader.read(&mut buffer).map_err(|e| RecordingError::io(&file, "read it", e))?;
            if read == 0 {
                break;
            }
            lines += memchr::memchr_iter(b'\n', &buffer[..read]).count() as u64;
        }
        Ok(Some(lines.min(most)))
    }
}

/// A table of text, unpacked, and what it is called in messages.
type Table = (Box<dyn Read>, String);

/// A file that is a table of text; none of anything else.
fn table(path: &Path) -> Result<Option<Table>, RecordingError> {
    // an episode of a file is no file
    if !path.exists() && episode(path).is_some() {
        return Ok(None);
    }
    let file = path.display().to_string();
    let mut reader = File::open(path).map_err(|e| RecordingError::io(&file, "open it", e))?;
    let (head, format) = sniff::head(&mut reader, &file)?;
    let all = Cursor::new(head).chain(reader);
    Ok(match format {
        Format::Text => Some((Box::new(all), file)),
        #[cfg(feature = "gzip")]
        Format::Gzip => {
            let mut reader = crate::room::Unpacked::new(all).0;
            let (head, format) = sniff::head(&mut reader, &file)?;
            let is_text = format == Format::Text;
            is_text.then(|| (Box::new(Cursor::new(head).chain(reader)) as Box<dyn Read>, file))
        }
        _ => None,
    })
}

/// Some rows of a trial.
fn part(trial: &Trial, from: usize, to: usize) -> Trial {
    let channel =
        |c: &Channel| Channel { name: c.name.clone(), values: c.values[from..to].to_vec() };
    Trial {
        name: trial.name.clone(),
        time_s: trial.time_s[from..to].to_vec(),
        channels: trial.channels.iter().map(channel).collect(),
    }
}
