//! Reads a recording: text in any dialect, arrays, Parquet.

use std::{
    io::{self, Cursor, Read},
    path::Path,
};

use stretch_data::files::open_input;

use crate::{
    ReadOptions, Recording, RecordingError, grid,
    room::{Packed, Unpacked},
    sniff,
    sniff::Format,
    text,
};

/// Name of standard input in messages.
pub(crate) const STDIN: &str = "standard input";

impl Recording {
    /// Reads a recording from a file, `-` being standard input.
    ///
    /// The format is recognised by the file's first bytes, never by its name:
    ///
    /// - A table of text: separated by commas, semicolons, tabs or runs of blanks; with decimal points or, if commas do
    ///   not separate columns, decimal commas; with comment lines (`#`, `%`, `//`), lines above the header, a row of
    ///   units, or units in brackets (`Pos (mm)` becomes `pos_mm`). The time can be in seconds, `ms`, `us` or `ns`,
    ///   count from 1970, or be in ISO 8601. The header line can be missing if [`ReadOptions::columns`] names the
    ///   columns.
    /// - NumPy's NPY and NPZ.
    /// - Any of these in gzip.
    /// - Parquet (feature `parquet`). `FILE#3` reads episode 3 of a LeRobot file with several episodes.
    ///
    /// MCAP, ROS bags, MAT and HDF5 are refused. The error names the command of the Python package that converts them.
    ///
    /// Channels on several clocks are resampled to the fastest clock, or to [`ReadOptions::grid_hz`], within the time
    /// that all of them cover. Values are interpolated linearly, except that the commands `inlet` and `outlet` keep
    /// their previous value.
    ///
    /// # Errors
    /// - The file cannot be opened or read, or its format is not supported.
    /// - The content is invalid for its format. The error gives row and column, if there are any.
    /// - A column that [`ReadOptions::require`] asks for is missing.
    /// - The sample rate is outside 1e-3 .. 1e6 Hz, or 1e-3 .. 1e7 Hz if an option gives the unit or the rate.
    /// - A time without a clear unit may be seconds or milliseconds.
    pub fn read(path: impl AsRef<Path>, options: &ReadOptions) -> Result<Self, RecordingError> {
        let path = path.as_ref();
        if path.as_os_str() == "-" {
            return Self::from_reader(io::stdin().lock(), STDIN, options);
        }
        if let (false, Some((path, episode))) = (path.exists(), episode(path)) {
            return Self::read(path, &options.of_episode(episode));
        }
        let file = path.display().to_string();
        let reader = open_input(path).map_err(|e| RecordingError::io(&file, "open it", e))?;
        let mut recording = Self::from_reader(reader, &file, options)?;
        if let Some(name) = path.file_name() {
            recording.trial.name = name.to_string_lossy().into_owned();
        }
        Ok(recording)
    }

    /// Reads a recording from any stream; messages call it `name`.
    ///
    /// # Errors
    /// The errors of [`Recording::read`].
    pub fn from_reader(
        mut reader: impl Read,
        name: &str,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let (head, format) = sniff::head(&mut reader, name)?;
        Self::read_format(format, &mut Cursor::new(head).chain(reader), name, options, None)
    }

    /// Returns whether a stream that begins with `head` is a table of text. The rows of a table can be read one at a
    /// time.
    pub fn is_text(head: &[u8]) -> bool {
        Format::of(head) == Format::Text
    }

    fn read_format(
        format: Format,
        reader: &mut dyn Read,
        name: &str,
        options: &ReadOptions,
        packed: Option<&Packed>,
    ) -> Result<Self, RecordingError> {
        if format == Format::Gzip {
            return Self::unpacked(reader, name, options);
        }
        if options.episode.is_some() && format != Format::Parquet {
            let problem = "it holds no episodes; remove the # and the number from its name";
            return Err(RecordingError::format(name, "file", problem));
        }
        if format == Format::Text {
            return text::read(reader, name, options, packed);
        }
        let (tracks, notes) = format.tracks(reader, name, options, packed)?;
        grid::merged(name, tracks, notes, options)
    }

    fn unpacked(
        reader: &mut dyn Read,
        name: &str,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let (mut reader, packed) = Unpacked::new(reader);
        let (head, format) = sniff::head(&mut reader, name)?;
        if format == Format::Gzip {
            let problem = "it is packed twice; unpack it once with gunzip";
            return Err(RecordingError::format(name, "gzip", problem));
        }
        let all = &mut Cursor::new(head).chain(reader);
        Self::read_format(format, all, name, options, Some(&packed))
    }
}

/// Splits `file.parquet#3` into the file and the requested episode.
pub(crate) fn episode(path: &Path) -> Option<(&Path, u32)> {
    let (file, episode) = path.to_str()?.rsplit_once('#')?;
    Some((Path::new(file), episode.parse().ok()?))
}
