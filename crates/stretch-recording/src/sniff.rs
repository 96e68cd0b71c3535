//! What a file is, by its first bytes.

use std::io::Read;

use crate::{
    ReadOptions, RecordingError,
    grid::Track,
    room::{self, Packed},
};

/// Bytes that tell every format apart: HDF5 behind the header of a MAT file begins at 512.
const HEAD_BYTES: usize = 520;

/// A format of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Text,
    Gzip,
    Npy,
    Npz,
    Mat,
    Hdf5,
    Mcap,
    Parquet,
    Rosbag,
    /// Known and not read: what it is, and what to do.
    Foreign(&'static str, &'static str),
}

/// Formats that are known to be none of those that are read.
const FOREIGN: [(&[u8], &str, &str); 6] = [
    (b"#ROSBAG", "ROS 1 bag", "convert it with `mcap convert in.bag out.mcap`"),
    (b"ARROW1", "Arrow", "write it as Parquet"),
    (b"\x28\xb5\x2f\xfd", "zstd", "unpack it with unzstd, or pack it with gzip"),
    (b"BZh", "bzip2", "unpack it with bunzip2, or pack it with gzip"),
    (b"\xfd7zXZ\0", "xz", "unpack it with unxz, or pack it with gzip"),
    (b"\xd0\xcf\x11\xe0", "Excel", "save the sheet as CSV"),
];

impl Format {
    /// The format of a file that begins so.
    pub(crate) fn of(head: &[u8]) -> Self {
        let is_hdf5 =
            |at: usize| head.get(at..).is_some_and(|h| h.starts_with(b"\x89HDF\r\n\x1a\n"));
        let foreign = FOREIGN.iter().find(|(magic, ..)| head.starts_with(magic));
        match head {
            [0x1f, 0x8b, ..] => Self::Gzip,
            _ if head.starts_with(b"\x93NUMPY") => Self::Npy,
            _ if head.starts_with(b"PK\x03\x04") || head.starts_with(b"PK\x05\x06") => Self::Npz,
            _ if is_hdf5(0) || is_hdf5(512) => Self::Hdf5,
            _ if head.starts_with(b"\x89MCAP0\r\n") => Self::Mcap,
            _ if head.starts_with(b"PAR1") => Self::Parquet,
            _ if head.starts_with(b"SQLite format 3\0") => Self::Rosbag,
            _ if is_mat(head) => Self::Mat,
            _ if is_page(head) => {
                Self::Foreign("HTML", "a server answered in place of the file; download it again")
            }
            _ if is_json(head) => {
                Self::Foreign("JSON", "write a row a sample as CSV, or messages as MCAP")
            }
            _ => foreign.map_or(Self::Text, |(_, what, todo)| Self::Foreign(what, todo)),
        }
    }

    /// Reads a recording that is no table of text: what is on each clock, and notes.
    // Without a feature its format needs none of the arguments.
    #[allow(unused_mut, unused_variables)]
    pub(crate) fn tracks(
        self,
        reader: &mut dyn Read,
        file: &str,
        options: &ReadOptions,
        packed: Option<&Packed>,
    ) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
        let off = |format, feature| -> Result<(Vec<Track>, Vec<String>), RecordingError> {
            Err(RecordingError::Feature { file: file.to_owned(), format, feature })
        };
        let mut whole = || {
            let read = room::whole(reader, packed);
            let read = read.map_err(|e| RecordingError::io(file, "read it", e))?;
            read.map_err(|problem| RecordingError::Format {
                file: file.to_owned(),
                format: "file",
                problem,
            })
        };
        match self {
            #[cfg(feature = "npz")]
            Self::Npy => crate::arrays::npy::read(whole()?, file, options),
            #[cfg(feature = "npz")]
            Self::Npz => crate::arrays::npy::read_archive(whole()?, file, options),
            #[cfg(feature = "mat")]
            Self::Mat => crate::arrays::mat::read(whole()?, file, options),
            #[cfg(feature = "hdf5")]
            Self::Hdf5 => crate::arrays::hdf5::read(whole()?, file, options),
            #[cfg(feature = "mcap")]
            Self::Mcap => crate::mcap::read(whole()?, file),
            #[cfg(feature = "parquet")]
            Self::Parquet => crate::parquet::read(whole()?, file, options),
            #[cfg(feature = "rosbag")]
            Self::Rosbag => crate::rosbag::read(whole()?, file),
            #[cfg(not(feature = "npz"))]
            Self::Npy | Self::Npz => off("a NumPy file", "npz"),
            #[cfg(not(feature = "mat"))]
            Self::Mat => off("a MAT file", "mat"),
            #[cfg(not(feature = "hdf5"))]
            Self::Hdf5 => {
                off("an HDF5 file (a MAT file of version 7.3 is one; save it with -v7)", "hdf5")
            }
            #[cfg(not(feature = "mcap"))]
            Self::Mcap => off("an MCAP file", "mcap"),
            #[cfg(not(feature = "parquet"))]
            Self::Parquet => off("a Parquet file", "parquet"),
            #[cfg(not(feature = "rosbag"))]
            Self::Rosbag => off("a ROS 2 bag in SQLite", "rosbag"),
            Self::Foreign(format, todo) => {
                let problem = format!("recordings of this kind are not read; {todo}");
                Err(RecordingError::Format { file: file.to_owned(), format, problem })
            }
            Self::Text | Self::Gzip => {
                let problem = "it is none of arrays or messages".to_owned();
                Err(RecordingError::Format { file: file.to_owned(), format: "text", problem })
            }
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

/// A MAT file of version 5: its text, or its version and byte order.
fn is_mat(head: &[u8]) -> bool {
    head.starts_with(b"MATLAB 5.0 MAT-file")
        || matches!(head.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
}

/// The first bytes of a stream, and what they tell.
pub(crate) fn head(reader: &mut dyn Read, file: &str) -> Result<(Vec<u8>, Format), RecordingError> {
    let mut head = Vec::with_capacity(HEAD_BYTES);
    let read = reader.take(HEAD_BYTES as u64).read_to_end(&mut head);
    read.map_err(|e| RecordingError::io(file, "read it", e))?;
    let format = Format::of(&head);
    Ok((head, format))
}
