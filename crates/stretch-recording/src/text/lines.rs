//! Splits a stream into lines in bounded memory. Each line is returned as soon as it is complete.

use std::io::{BufRead, BufReader, Read};

use crate::{RecordingError, stamps::looks_like_stamp};

const BUFFER_BYTES: usize = 256 * 1024;

/// A splitter of a stream into lines. It never holds more than its buffer and one line.
pub(crate) struct Lines<R> {
    reader: BufReader<R>,
    file: String,
    line: Vec<u8>,
    row: u64,
    limit: usize,
    /// Whether the rest of the last line has not been read yet.
    is_cut: bool,
}

impl<R: Read> Lines<R> {
    /// Creates a splitter for `file` that accepts lines of at most `limit` bytes.
    pub(crate) fn new(reader: R, file: &str, limit: usize) -> Self {
        let reader = BufReader::with_capacity(BUFFER_BYTES, reader);
        Self { reader, file: file.to_owned(), line: Vec::new(), row: 0, limit, is_cut: false }
    }

    /// Returns the next line that is not blank, and its row, counted from 1. The line end and a UTF-8 byte-order mark
    /// are removed. After an error for a line that is too long, the next line follows.
    pub(crate) fn next(&mut self) -> Result<Option<(u64, &[u8])>, RecordingError> {
        loop {
            if !self.read()? {
                return Ok(None);
            }
            self.row += 1;
            self.is_cut = self.line.pop_if(|byte| *byte == b'\n').is_none();
            self.line.pop_if(|byte| *byte == b'\r');
            if self.line.len() > self.limit {
                let (file, row, limit) = (self.file.clone(), self.row, self.limit);
                return Err(RecordingError::LineTooLong { file, row, limit });
            }
            if self.row == 1 && self.line.starts_with(b"\xef\xbb\xbf") {
                self.line.drain(..3);
            }
            if self.line.get(2) == Some(&b':') || self.line.first() == Some(&b'[') {
                part_stamp(&mut self.line);
            }
            if !self.line.trim_ascii().is_empty() {
                return Ok(Some((self.row, &self.line)));
            }
        }
    }

    /// Reads the next line, or enough of it to detect that it is too long. Returns false if there is none.
    fn read(&mut self) -> Result<bool, RecordingError> {
        let failed = |e| RecordingError::io(&self.file, "read it", e);
        if std::mem::take(&mut self.is_cut) {
            self.reader.skip_until(b'\n').map_err(failed)?;
        }
        self.line.clear();
        let most = self.limit.saturating_add(2) as u64;
        let taken = self.reader.by_ref().take(most).read_until(b'\n', &mut self.line);
        Ok(taken.map_err(failed)? > 0)
    }
}

/// Puts a separator after the time that a serial monitor writes before each line: `10:00:00.020 -> 101.3,1.02`, and
/// `[2024-05-01 10:00:00.020] 101.3,1.02`.
fn part_stamp(line: &mut Vec<u8>) {
    let (start, end): (_, &[u8]) = if line.starts_with(b"[") { (1, b"] ") } else { (0, b" -> ") };
    let Some(at) = memchr::memmem::find(line, end) else { return };
    if str::from_utf8(&line[start..at]).is_ok_and(looks_like_stamp) {
        let separator = [b';', b'\t', b','].into_iter().find(|byte| line[at..].contains(byte));
        line.splice(at..at + end.len(), [separator.unwrap_or(b' ')]);
        line.drain(..start);
    }
}

/// Decodes text in Windows-1252.
pub(crate) fn windows_1252(bytes: &[u8]) -> String {
    /// Characters of 0x80 to 0x9f. Five of these bytes are not assigned.
    const FROM_0X80: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8d}Ž\u{8f}\u{90}‘’“”•–—˜™š›œ\u{9d}žŸ";
    let character = |byte: &u8| match byte {
        0x80..=0x9f => FROM_0X80.chars().nth(usize::from(byte - 0x80)).unwrap_or_default(),
        byte => char::from(*byte),
    };
    bytes.iter().map(character).collect()
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    /// Returns one byte per read, which is the worst case for splitting lines.
    struct Dribble<'a>(&'a [u8]);

    impl Read for Dribble<'_> {
        fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
            let count = self.0.len().min(out.len()).min(1);
            out[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    fn all(reader: impl Read, limit: usize) -> Vec<(u64, Option<String>)> {
        let mut lines = Lines::new(reader, "memory", limit);
        let mut out = Vec::new();
        loop {
            out.push(match lines.next() {
                Ok(Some((row, text))) => {
                    (row, Some(String::from_utf8(text.to_vec()).expect("text")))
                }
                Err(RecordingError::LineTooLong { row, .. }) => (row, None),
                Ok(None) => return out,
                Err(error) => panic!("memory does not fail: {error}"),
            });
        }
    }

    #[test]
    fn lines_end_in_any_way_and_blank_and_long_ones_are_skipped_with_their_row() {
        let text = b"a\r\nbb\n\n123456789\nlast";
        let expected =
            [(1, Some("a".into())), (2, Some("bb".into())), (4, None), (5, Some("last".into()))];
        assert_eq!(all(&text[..], 4), expected);
        assert_eq!(all(Dribble(text), 4), expected);
    }

    #[test]
    fn lines_across_the_buffer_are_whole() {
        let line = "x".repeat(1000);
        let text = format!("{line}\n").repeat(2000);
        let out = all(text.as_bytes(), 1000);
        assert_eq!(out.len(), 2000);
        assert!(out.iter().all(|(_, text)| text.as_deref() == Some(line.as_str())));
        assert!(all(text.as_bytes(), 999).iter().all(|(_, text)| text.is_none()));
    }
}
