//! A checksum over all answers of a receptor.

use stretch_receptor::{Withheld, code::CodeReading};

/// An FNV-1a hash, 32 bits.
#[derive(Debug, Clone, Copy)]
pub struct Checksum(pub u32);

impl Default for Checksum {
    fn default() -> Self {
        Self(0x811c_9dc5)
    }
}

/// The bits of an estimate.
pub trait Bits {
    /// Returns the bits in their memory representation.
    fn bits(self) -> u32;
}

impl Bits for i32 {
    fn bits(self) -> u32 {
        self as u32
    }
}

impl Bits for f32 {
    fn bits(self) -> u32 {
        self.to_bits()
    }
}

impl Checksum {
    fn byte(&mut self, byte: u8) {
        self.0 = (self.0 ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    }

    /// Adds one answer: its kind, branch and domain, and every bit of the estimate.
    pub fn answer<E: Bits>(&mut self, answer: Result<CodeReading<E>, Withheld>) {
        match answer {
            Ok(reading) => {
                self.byte(1 | (reading.branch as u8) << 1 | (reading.domain as u8) << 2);
                reading.estimate.bits().to_le_bytes().into_iter().for_each(|byte| self.byte(byte));
            }
            Err(Withheld::Warming) => self.byte(0x80),
            Err(_) => self.byte(0x81),
        }
    }
}
