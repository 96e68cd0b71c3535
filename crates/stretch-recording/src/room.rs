//! How much memory a file may take once it is read: a small file that unpacks to gigabytes is refused before they are taken.

use std::{
    cell::Cell,
    io::{self, Read},
    rc::Rc,
};

/// Memory that any file may take, bytes.
const ANY: u64 = 192 << 20;
/// What a file may take beyond that, in multiples of its size: with its bytes themselves there are four.
const TIMES: u64 = 3;
/// The largest file of arrays, which are read whole, and the most numbers of a table of text, bytes.
const LARGEST: u64 = 4 << 30;
/// What a packed file may always unpack to, bytes.
const UNPACKED: u64 = 64 << 20;
/// Greatest length of what is unpacked in lengths of what was packed. Recordings reach 20; a kilobyte of blanks in each byte is an attack.
const RATIO: u64 = 100;
/// Bytes that are read at once.
const PIECE: u64 = 1 << 20;

/// Bytes of a packed stream that have been unpacked so far.
pub(crate) type Packed = Cell<u64>;

/// Memory that the data of a file may take in addition to the bytes of the file.
#[derive(Debug)]
pub(crate) struct Room {
    most: u64,
    taken: u64,
}

impl Room {
    /// The room of a file of so many bytes.
    pub(crate) fn beside(file_bytes: u64) -> Self {
        Self { most: ANY.saturating_add(TIMES.saturating_mul(file_bytes)), taken: 0 }
    }

    /// The room of a table of text that is not packed.
    pub(crate) fn of_text() -> Self {
        Self { most: LARGEST, taken: 0 }
    }

    /// Takes room before memory is taken.
    ///
    /// # Errors
    /// There is no more; the text says so.
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

    /// Takes room for numbers.
    pub(crate) fn take_numbers(&mut self, count: usize) -> Result<(), String> {
        self.take((count as u64).saturating_mul(size_of::<f64>() as u64))
    }

    /// Takes room for what every recording has in addition to its channels: its time, and for its rate the steps of that.
    pub(crate) fn take_time(&mut self, rows: usize) -> Result<(), String> {
        self.take_numbers(rows.saturating_mul(2))
    }

    /// Unpacks a stream into memory.
    pub(crate) fn unpack(&mut self, reader: impl Read) -> io::Result<Result<Vec<u8>, String>> {
        let (mut bytes, left) = (Vec::new(), self.most.saturating_sub(self.taken));
        reader.take(left + 1).read_to_end(&mut bytes)?;
        // what it grew into is up to twice as much
        bytes.shrink_to_fit();
        Ok(self.take(bytes.len() as u64).map(|()| bytes))
    }

    /// Gives room back that is used no more.
    pub(crate) fn give_back(&mut self, bytes: usize) {
        self.taken = self.taken.saturating_sub(bytes as u64);
    }
}

/// A file of arrays as a whole, and the memory that it may take.
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
                "it is larger than {most} GB, and is read whole; save it in parts"
            )));
        }
        if read == 0 {
            bytes.shrink_to_fit();
            return Ok(Ok((bytes, room)));
        }
    }
}

/// What a stream of gzip unpacks to, refused where it grows beyond any recording.
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
    /// Unpacks a stream; the count of its packed bytes comes with it.
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
