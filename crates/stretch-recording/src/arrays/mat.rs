//! MATLAB's files of version 5 (`save` up to -v7): matrices of numbers, and structures of them.

use crate::{
    ReadOptions, RecordingError,
    arrays::{Array, beside, tracks},
    grid::{Track, listed, note},
    room::Room,
    whole::{signed, word},
};

/// Structures within structures; a file that says more is broken.
const DEEPEST: usize = 16;
const HEADER_BYTES: usize = 128;

/// Types of data elements.
const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

/// Reads a file's arrays.
pub(crate) fn read(
    (bytes, room): (Vec<u8>, Room),
    file: &str,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let fail = |problem| RecordingError::Format { file: file.to_owned(), format: "MAT", problem };
    let is_big = bytes.get(126..128) == Some(b"MI");
    let mut found = Found { room, arrays: Vec::new(), other: Vec::new(), full: None };
    let mut rest = Bytes { bytes: bytes.get(HEADER_BYTES..).unwrap_or_default(), is_big };
    let mut block = 0_usize;
    while !rest.bytes.is_empty() {
        block += 1;
        let broken =
            || fail(format!("variable {block} ends before its end; save the file again with -v7"));
        let (kind, data) = rest.element(false).ok_or_else(broken)?;
        let taken = if kind == COMPRESSED {
            let unpacked = found.room.unpack(flate2::read::ZlibDecoder::new(data));
            let unpacked = unpacked.map_err(|_| broken())?.map_err(fail)?;
            let mut inner = Bytes { bytes: &unpacked, is_big };
            let (kind, data) = inner.element(false).ok_or_else(broken)?;
            let taken = found.variable(kind, Bytes { bytes: data, is_big });
            found.room.give_back(unpacked.len());
            taken
        } else {
            found.variable(kind, Bytes { bytes: data, is_big })
        };
        if taken.is_none() {
            return Err(found.full.take().map_or_else(broken, fail));
        }
    }
    drop(bytes);
    let mut notes = Vec::new();
    if found.arrays.is_empty() {
        return Err(fail(match &found.other[..] {
            [] => "there is no variable in it".to_owned(),
            other => format!(
                "none of its variables is a matrix of numbers: {}; save their arrays",
                listed(other)
            ),
        }));
    }
    note(&mut notes, "left out", &found.other);
    beside(&found.arrays, &mut found.room).map_err(fail)?;
    tracks(file, found.arrays, notes, options)
}

/// What is left of a block.
#[derive(Debug, Clone, Copy)]
struct Bytes<'a> {
    bytes: &'a [u8],
    is_big: bool,
}

impl<'a> Bytes<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(head)
    }

    fn word(&self, bytes: &[u8]) -> Option<u32> {
        Some(word(bytes.get(..4)?, self.is_big) as u32)
    }

    /// The next data element: its type and its data. Small ones hold both in eight bytes.
    fn element(&mut self, padded: bool) -> Option<(u32, &'a [u8])> {
        let tag = self.take(8)?;
        let first = self.word(tag)?;
        if first >> 16 != 0 {
            let count = (first >> 16) as usize;
            return Some((first & 0xffff, tag.get(4..4 + count)?));
        }
        let count = self.word(&tag[4..])? as usize;
        let data = self.take(count)?;
        let padding = if padded { (8 - count % 8) % 8 } else { 0 };
        self.take(padding.min(self.bytes.len()))?;
        Some((first, data))
    }

    /// The numbers of an element of type `kind`.
    fn numbers(&self, kind: u32, data: &[u8]) -> Option<Vec<f64>> {
        let bytes = bytes_of(kind)?;
        let value = |item: &[u8]| match (kind, word(item, self.is_big)) {
            (1 | 3 | 5 | 12, word) => signed(word, bytes),
            (7, word) => f32::from_bits(word as u32).into(),
            (9, word) => f64::from_bits(word),
            (_, word) => word as f64,
        };
        Some(data.chunks_exact(bytes).map(value).collect())
    }
}

/// Bytes of a number of an element's type; none where the type is none of numbers.
fn bytes_of(kind: u32) -> Option<usize> {
    match kind {
        1 | 2 => Some(1),
        3 | 4 => Some(2),
        5..=7 => Some(4),
        9 | 12 | 13 => Some(8),
        _ => None,
    }
}

/// Variables that hold numbers, and those that do not.
struct Found {
    arrays: Vec<Array>,
    other: Vec<String>,
    room: Room,
    /// Why no more is taken: the room is used up.
    full: Option<String>,
}

impl Found {
    /// Takes a variable that is a matrix, and passes over any other.
    fn variable(&mut self, kind: u32, rest: Bytes<'_>) -> Option<()> {
        if kind == MATRIX { self.matrix(rest, "", 0) } else { Some(()) }
    }

    /// The numbers of an element, where there is room for them.
    fn numbers(&mut self, rest: &Bytes<'_>, kind: u32, data: &[u8]) -> Option<Vec<f64>> {
        let count = data.len() / bytes_of(kind)?;
        if let Err(full) = self.room.take_numbers(count) {
            self.full = Some(full);
            return None;
        }
        rest.numbers(kind, data)
    }

    /// Takes a matrix below `path`; none where it ends before its end.
    fn matrix(&mut self, mut rest: Bytes<'_>, path: &str, depth: usize) -> Option<()> {
        if rest.bytes.is_empty() {
            return Some(());
        }
        let (_, flags) = rest.element(true)?;
        let flags = rest.word(flags)?;
        let class = flags & 0xff;
        let (kind, dims) = rest.element(true)?;
        let dims: Vec<usize> =
            self.numbers(&rest, kind, dims)?.into_iter().map(|n| n.max(0.0) as usize).collect();
        let (_, own) = rest.element(true)?;
        let own = String::from_utf8_lossy(own).into_owned();
        let name = match (path, &own[..]) {
            ("", _) => own,
            (_, "") => path.to_owned(),
            _ => format!("{path}.{own}"),
        };
        match class {
            6..=15 => {
                let (kind, data) = rest.element(true)?;
                let values = self.numbers(&rest, kind, data)?;
                let count = dims.iter().try_fold(1_usize, |n, &m| n.checked_mul(m))?;
                if values.len() != count {
                    return None;
                }
                if flags & 0x0800 != 0 {
                    self.other.push(format!("{name} (complex)"));
                } else {
                    // Columns first in the file: the other way round the last index is the fastest.
                    let shape = dims.into_iter().rev().collect();
                    self.arrays.push(Array { name, shape, values });
                }
            }
            2 if dims.iter().all(|n| *n == 1) && depth < DEEPEST => {
                self.structure(rest, &name, depth)?;
            }
            2 => self.other.push(format!("{name} (an array of structures)")),
            1 => self.other.push(format!("{name} (cells)")),
            4 => self.other.push(format!("{name} (text)")),
            5 => self.other.push(format!("{name} (sparse)")),
            _ => self.other.push(format!("{name} (an object)")),
        }
        Some(())
    }

    fn structure(&mut self, mut rest: Bytes<'_>, name: &str, depth: usize) -> Option<()> {
        let (kind, length) = rest.element(true)?;
        let length = *self.numbers(&rest, kind, length)?.first()? as usize;
        let (_, names) = rest.element(true)?;
        if length == 0 {
            return Some(());
        }
        for field in names.chunks_exact(length) {
            let end = field.iter().position(|&b| b == 0).unwrap_or(length);
            let field = String::from_utf8_lossy(&field[..end]);
            let (kind, data) = rest.element(true)?;
            if kind == MATRIX {
                let inner = Bytes { bytes: data, is_big: rest.is_big };
                self.matrix(inner, &format!("{name}.{field}"), depth + 1)?;
            }
        }
        Some(())
    }
}
