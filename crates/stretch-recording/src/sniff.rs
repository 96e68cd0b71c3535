//! Recognises the format of a file by its first bytes.

use std::io::Read;

use crate::{
    ReadOptions, RecordingError,
    arrays::npy,
    grid::Track,
    room::{self, Packed},
};

/// Number of first bytes that are enough to distinguish all formats. The HDF5 signature after the header of a MAT file
/// begins at byte 512.
const HEAD_BYTES: usize = 520;

/// A format of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Text,
    Gzip,
    Npy,
    Npz,
    Parquet,
    /// A format that only the Python package reads, with the library of the format's owners. The fields are the name of
    /// the format and the extra of the Python package.
    Python(&'static str, &'static str),
    /// A known format that is not read. The fields are its name and what to do.
    Foreign(&'static str, &'static str),
}

/// Formats that the Python package converts.
const PYTHON: [(&[u8], &str, &str); 5] = [
    (b"\x89MCAP0\r\n", "an MCAP file", "ros"),
    (b"SQLite format 3\0", "a ROS 2 bag in SQLite", "ros"),
    (b"#ROSBAG", "a ROS 1 bag", "ros"),
    (b"MATLAB 7.3 MAT-file", "a MAT file of version 7.3", "matlab"),
    (HDF5, "an HDF5 file", "matlab"),
];
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Known formats that are not read.
const FOREIGN: [(&[u8], &str, &str); 5] = [
    (b"ARROW1", "Arrow", "write it as Parquet"),
    (b"\x28\xb5\x2f\xfd", "zstd", "unpack it with unzstd, or pack it with gzip"),
    (b"BZh", "bzip2", "unpack it with bunzip2, or pack it with gzip"),
    (b"\xfd7zXZ\0", "xz", "unpack it with unxz, or pack it with gzip"),
    (b"\xd0\xcf\x11\xe0", "Excel", EXCEL),
];
/// What to do with a spreadsheet.
pub(crate) const EXCEL: &str = "save the sheet as CSV";

impl Format {
    /// Returns the format of a file that begins with `head`.
    pub(crate) fn of(head: &[u8]) -> Self {
        let find = |known: &[(&[u8], &'static str, &'static str)]| {
            let found = known.iter().find(|(magic, ..)| head.starts_with(magic));
            found.map(|(_, what, more)| (*what, *more))
        };
        match head {
            [0x1f, 0x8b, ..] => Self::Gzip,
            _ if head.starts_with(b"\x93NUMPY") => Self::Npy,
            _ if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") => Self::Npz,
            _ if head.starts_with(b"PAR1") => Self::Parquet,
            // The 512 bytes before the HDF5 signature can contain anything.
            _ if head.get(512..).is_some_and(|h| h.starts_with(HDF5)) => {
                Self::Python("a MAT file of version 7.3", "matlab")
            }
            _ if is_mat(head) => Self::Python("a MAT file of version 5", "matlab"),
            _ if is_page(head) => Self::Foreign(
                "HTML",
                "it is probably the error page of a server; download the file again",
            ),
            _ if is_json(head) => Self::Foreign("JSON", "write CSV with one row per sample"),
            _ => match (find(&PYTHON), find(&FOREIGN)) {
                (Some((what, extra)), _) => Self::Python(what, extra),
                (None, Some((what, todo))) => Self::Foreign(what, todo),
                (None, None) => Self::Text,
            },
        }
    }

    /// Reads a recording that is not a table of text. Returns one track per clock, and notes.
    pub(crate) fn tracks(
        self,
        reader: &mut dyn Read,
        file: &str,
        options: &ReadOptions,
        packed: Option<&Packed>,
    ) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
        let refused = |format, problem: &str| RecordingError::format(file, format, problem);
        let mut whole = || {
            let read = room::whole(reader, packed);
            let read = read.map_err(|e| RecordingError::io(file, "read it", e))?;
            read.map_err(|problem| refused("file", &problem))
        };
        match self {
            Self::Npy => npy::read(whole()?, file, options),
            Self::Npz => npy::read_archive(whole()?, file, options),
            #[cfg(feature = "parquet")]
            Self::Parquet => crate::parquet::read(whole()?, file, options),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => Err(RecordingError::convert(file, "a Parquet file", "parquet")),
            Self::Python(format, extra) => Err(RecordingError::convert(file, format, extra)),
            Self::Foreign(format, todo) => Err(refused(format, todo)),
            Self::Text | Self::Gzip => Err(refused("text", "it holds no arrays")),
        }
    }
}

fn is_page(head: &[u8]) -> bool {
    let start = head.trim_ascii_start();
    [&b"<!doctype"[..], b"<html"]
        .iter()
        .any(|tag| start.get(..tag.len()).is_some_and(|s| s.eq_ignore_ascii_case(tag)))
}

fn is_json(head: &[u8]) -> bool {
    matches!(head.trim_ascii_start(), [b'{', rest @ ..] | [b'[', b'{', rest @ ..]
        if rest.trim_ascii_start().starts_with(b"\""))
}

/// Returns whether a file is a MAT file of version 5, from its header text or from its version and byte order.
fn is_mat(head: &[u8]) -> bool {
    head.starts_with(b"MATLAB 5.0 MAT-file")
        || matches!(head.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
}

/// Reads the first bytes of a stream, and returns them with the format that was recognised from them.
pub(crate) fn head(reader: &mut dyn Read, file: &str) -> Result<(Vec<u8>, Format), RecordingError> {
    let mut head = Vec::with_capacity(HEAD_BYTES);
    let read = reader.take(HEAD_BYTES as u64).read_to_end(&mut head);
    read.map_err(|e| RecordingError::io(file, "read it", e))?;
    let format = Format::of(&head);
    Ok((head, format))
}
