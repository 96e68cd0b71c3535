//! Lines of a stream in bounded memory, each as soon as it is there.

use std::io::{self, Read};

const BUFFER_BYTES: usize = 256 * 1024;

/// What came out of the stream.
pub(crate) enum Line<'a> {
    /// A line without its end.
    Text(&'a [u8]),
    /// More than the limit without a line end.
    TooLong,
    /// The end of the stream.
    End,
}

/// Splits a stream into lines; never holds more than its buffer.
pub(crate) struct Lines<R> {
    reader: R,
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    row: u64,
    limit: usize,
    ended: bool,
}

impl<R: Read> Lines<R> {
    pub(crate) fn new(reader: R, limit: usize) -> Self {
        let buffer = vec![0; BUFFER_BYTES.max(limit.saturating_add(2))];
        Self { reader, buffer, start: 0, end: 0, row: 0, limit, ended: false }
    }

    /// Row of the line that came last; the first is 1.
    pub(crate) fn row(&self) -> u64 {
        self.row
    }

    /// The longest line that is accepted.
    pub(crate) fn limit(&self) -> usize {
        self.limit
    }

    /// The next line, read only when none is complete in the buffer.
    pub(crate) fn next(&mut self) -> io::Result<Line<'_>> {
        let mut searched = self.start;
        loop {
            if let Some(at) = memchr::memchr(b'\n', &self.buffer[searched..self.end]) {
                return Ok(self.take(searched + at, searched + at + 1));
            }
            searched = self.end;
            if self.end - self.start > self.limit + 1 {
                self.row += 1;
                return Ok(Line::TooLong);
            }
            if self.ended {
                if self.start == self.end {
                    return Ok(Line::End);
                }
                return Ok(self.take(self.end, self.end));
            }
            searched -= self.make_room();
            self.fill()?;
        }
    }

    /// Drops everything up to the next line end, after [`Line::TooLong`].
    pub(crate) fn skip_line(&mut self) -> io::Result<()> {
        loop {
            if let Some(at) = memchr::memchr(b'\n', &self.buffer[self.start..self.end]) {
                self.start += at + 1;
                return Ok(());
            }
            (self.start, self.end) = (0, 0);
            if self.ended {
                return Ok(());
            }
            self.fill()?;
        }
    }

    fn take(&mut self, line_end: usize, next: usize) -> Line<'_> {
        let line = &self.buffer[self.start..line_end];
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        self.start = next;
        self.row += 1;
        if line.len() > self.limit {
            // Complete in the buffer already: there is nothing to skip but the caller will
            // skip a line, so leave it where it was.
            self.start = next - usize::from(next > line_end);
            return Line::TooLong;
        }
        Line::Text(line)
    }

    /// Moves what is left to the front when the buffer is full; says by how much.
    fn make_room(&mut self) -> usize {
        if self.end < self.buffer.len() && self.start < self.end {
            return 0;
        }
        let moved = self.start;
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - moved);
        moved
    }

    fn fill(&mut self) -> io::Result<()> {
        loop {
            match self.reader.read(&mut self.buffer[self.end..]) {
                Ok(count) => {
                    self.ended = count == 0;
                    self.end += count;
                    return Ok(());
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hands out one byte a read: the worst case for a splitter.
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
        let mut lines = Lines::new(reader, limit);
        let mut out = Vec::new();
        loop {
            let item = match lines.next().expect("memory does not fail") {
                Line::Text(text) => Some(String::from_utf8(text.to_vec()).expect("text")),
                Line::TooLong => None,
                Line::End => return out,
            };
            if item.is_none() {
                lines.skip_line().expect("memory does not fail");
            }
            out.push((lines.row(), item));
        }
    }

    #[test]
    fn lines_end_in_any_way_and_long_ones_are_skipped_with_their_row() {
        let text = b"a\r\nbb\n\n123456789\nlast";
        let expected = [
            (1, Some("a".into())),
            (2, Some("bb".into())),
            (3, Some(String::new())),
            (4, None),
            (5, Some("last".into())),
        ];
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
