//! Writes and parses decimal and hexadecimal numbers without `core::fmt`, which would be the
//! largest part of a small firmware.

/// A line that is being written. Bytes that do not fit are dropped; a buffer of
/// [`Frame::LONGEST`](crate::Frame::LONGEST) bytes is always long enough.
pub(crate) struct Writer<'a> {
    bytes: &'a mut [u8],
    length: usize,
}

impl<'a> Writer<'a> {
    pub(crate) fn new(bytes: &'a mut [u8]) -> Self {
        Self { bytes, length: 0 }
    }

    pub(crate) fn byte(&mut self, byte: u8) {
        if let Some(place) = self.bytes.get_mut(self.length) {
            *place = byte;
            self.length += 1;
        }
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.byte(byte));
    }

    pub(crate) fn unsigned(&mut self, number: u32) {
        let mut divisor = 1;
        while number / divisor >= 10 {
            divisor *= 10;
        }
        while divisor > 0 {
            self.byte(b'0' + (number / divisor % 10) as u8);
            divisor /= 10;
        }
    }

    pub(crate) fn signed(&mut self, number: i32) {
        if number < 0 {
            self.byte(b'-');
        }
        self.unsigned(number.unsigned_abs());
    }

    pub(crate) fn hexadecimal(&mut self, number: u32) {
        for nibble in (0..8).rev() {
            self.byte(b"0123456789ABCDEF"[(number >> (4 * nibble) & 15) as usize]);
        }
    }

    pub(crate) fn written(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    pub(crate) fn finish(self) -> &'a [u8] {
        &self.bytes[..self.length]
    }
}

/// Parses a field as a number. The caller encodes the number again to refuse other spellings.
pub(crate) fn number<T: core::str::FromStr>(field: &[u8]) -> Option<T> {
    core::str::from_utf8(field).ok()?.parse().ok()
}
