//! Limits the memory that a file may take when it is read. A small file that unpacks to gigabytes is refused before the
//! memory is allocated.

use std::{
    cell::Cell,
    io::{self, Read},
    rc::Rc,
};

/// Memory that any file may take, bytes.
const ANY: u64 = 192 << 20;
/// Additional memory that a file may take, in multiples of its size. With the bytes of the file itself, the factor is
/// four.
const TIMES: u64 = 3;
/// Largest file of arrays, which is read as a whole, and largest memory for the numbers of a table of text, bytes.
const LARGEST: u64 = 4 << 30;
/// Size to which any packed file may unpack, bytes.
const UNPACKED: u64 = 64 << 20;
/// Largest compression ratio. Ratios of recordings are at most about 20; a ratio of a thousand is an attack.
const RATIO: u64 = 100;
/// Number of bytes that are read at once.
const PIECE: u64 = 1 << 20;

/// Number of bytes of a packed stream that have been read so far.
pub(crate) type Packed = Cell<u64>;

/// Memory budget for the data of a file, in addition to the bytes of the file.
#[derive(Debug)]
pub(crate) struct Room {
    most: u64,
    taken: u64,
}

impl Room {
    /// Creates the budget of a file of `file_bytes` bytes.
    pub(crate) fn beside(file_bytes: u64) -> Self {
        Self { most: ANY.saturating_add(TIMES.saturating_mul(file_bytes)), taken: 0 }
    }

    /// Creates the budget of a table of text that is not packed.
    pub(crate) fn of_text() -> Self {
        Self { most: LARGEST, taken: 0 }
    }

    /// Reserves memory from the budget before it is allocated.
    ///
    /// # Errors
    /// The budget is exceeded. The error is a sentence about this.
    pub(crate) fn take(&mut self, bytes: u64) -> Result<(), String> {
        self.taken = self.taken.saturating_add(bytes);
        if self.taken <= self.most {
            return Ok(());
        }
        let most = self.most >> 20;
        Err(format!(
            "it needs more than {most} MB of memory when it is read, which is the limit for a file of its size; save it unpacked, or in parts"
        ))
    }

    /// Reserves memory for numbers.
    pub(crate) fn take_numbers(&mut self, count: usize) -> Result<(), String> {
        self.take((count as u64).saturating_mul(size_of::<f64>() as u64))
    }

    /// Reserves memory for the time of a recording, and for the steps of that time from which the rate is computed.
    pub(crate) fn take_time(&mut self, rows: usize) -> Result<(), String> {
        self.take_numbers(rows.saturating_mul(2))
    }

    /// Reads an unpacked stream into memory, within the budget.
    pub(crate) fn unpack(&mut self, reader: impl Read) -> io::Result<Result<Vec<u8>, String>> {
        let (mut bytes, left) = (Vec::new(), self.most.saturating_sub(self.taken));
        reader.take(left + 1).read_to_end(&mut bytes)?;
        // The vector may have grown to twice its length.
        bytes.shrink_to_fit();
        Ok(self.take(bytes.len() as u64).map(|()| bytes))
    }

    /// Returns memory that is no longer used to the budget.
    pub(crate) fn give_back(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_sub(bytes as u64);
    }
}

/// Reads a file of arrays as a whole. Returns its bytes and its memory budget.
pub(crate) fn whole(
    reader: &mut dyn Read,
    packed: Option<&Packed>,
) -> io::Result<Result<(Vec<u8>, Room), String>> {
    let mut bytes = Vec::new();
    loop {
        let read = reader.take(PIECE).read_to_end(&mut bytes)?;
        let length = bytes.len() as u64;
        let mut room = Room::beside(packed.map_or(length, Cell::get));
        if let Some(full) = packed.and_then(|_| room.take(length).err()) {
            return Ok(Err(full));
        }
        if length > LARGEST {
            let most = LARGEST >> 30;
            return Ok(Err(format!(
                "it is larger than {most} GB, the limit for a file that is not text; save it in parts"
            )));
        }
        if read == 0 {
            bytes.shrink_to_fit();
            return Ok(Ok((bytes, room)));
        }
    }
}

/// An unpacked gzip stream. Reading fails if the compression ratio is too high for a recording.
pub(crate) struct Unpacked<R> {
    decoder: flate2::read::MultiGzDecoder<Counted<R>>,
    given: u64,
}

/// A stream whose bytes are counted.
struct Counted<R> {
    reader: R,
    count: Rc<Packed>,
}

impl<R: Read> Unpacked<R> {
    /// Creates the unpacked stream, and the counter of the packed bytes read so far.
    pub(crate) fn new(reader: R) -> (Self, Rc<Packed>) {
        let count = Rc::new(Packed::new(0));
        let counted = Counted { reader, count: count.clone() };
        (Self { decoder: flate2::read::MultiGzDecoder::new(counted), given: 0 }, count)
    }
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(out)?;
        self.count.set(self.count.get() + read as u64);
        Ok(read)
    }
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let read = self.decoder.read(out)?;
        self.given += read as u64;
        if self.given > UNPACKED + RATIO * self.decoder.get_ref().count.get() {
            return Err(io::Error::other(format!(
                "it unpacks to more than {RATIO} times its size, which is more than any recording; unpack it with gunzip and look at it"
            )));
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_what_any_file_may_take_and_three_times_its_size() {
        let mut room = Room::beside(1000);
        assert_eq!(room.take(ANY + 3000), Ok(()));
        assert!(room.take(1).unwrap_err().contains("more than 192 MB"));
        assert!(Room::beside(u64::MAX).take_numbers(usize::MAX).is_ok());
        assert!(Room::beside(0).take_numbers(usize::MAX).is_err());
    }

    #[test]
    fn a_stream_that_was_packed_may_be_no_longer_than_its_room() {
        let zeros = |count: u64| io::repeat(0).take(count);
        let packed = Packed::new(0);
        assert!(whole(&mut zeros(ANY + 1), Some(&packed)).unwrap().is_err());
        let (bytes, _) = whole(&mut zeros(3 * PIECE / 2), Some(&packed)).unwrap().unwrap();
        assert_eq!(bytes.len() as u64, 3 * PIECE / 2);
    }
}
