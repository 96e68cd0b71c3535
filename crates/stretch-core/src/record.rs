//! Binary files with a checksum, such as the calibration in the flash of a microcontroller.
//!
//! ```text
//! record = postcard(value), then CRC-32C of those bytes, least byte first
//! ```
//!
//! A `record` is such a file in memory. Its first field is its schema (format version). Schema 1 had no checksum and
//! can still be read. The checksum is Castagnoli's CRC (Koopman, DSN 2002). It detects every error of up to three bits
//! (up to five bits in files below 655 bytes), every burst of up to 32 bits, and all but one in 2^32 of other errors.
//!
//! The checksum detects damage. It does not protect against deliberate changes.

use crc::{CRC_32_ISCSI, Crc, NoTable};
use serde::{Deserialize, Serialize};

use crate::DesignError;

/// The schema of all binary calibration files that this release writes.
pub const SCHEMA: u32 = crate::CALIBRATION_SCHEMA;

/// Without a lookup table: this saves a kilobyte of flash and costs a few thousand instructions at start-up.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// Bytes of the checksum.
const SEAL: usize = 4;

/// Returns the CRC-32C of bytes.
///
/// ```
/// // the check value of the catalogue of CRC algorithms
/// assert_eq!(stretch_core::record::checksum(b"123456789"), 0xe306_9283);
/// ```
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Writes a value and its checksum to the beginning of `buffer`, and returns the written bytes.
///
/// # Errors
/// [`DesignError::TooLarge`] if the buffer is too small.
pub fn store<'b, T: Serialize>(value: &T, buffer: &'b mut [u8]) -> Result<&'b [u8], DesignError> {
    let most = buffer.len();
    let full = DesignError::TooLarge { field: "binary file in bytes", asked: most + 1, most };
    let body = postcard::to_slice(value, buffer).map_err(|_| full)?;
    let (length, seal) = (body.len(), checksum(body).to_le_bytes());
    let place = buffer.get_mut(length..length + SEAL).ok_or(full)?;
    place.copy_from_slice(&seal);
    Ok(&buffer[..length + SEAL])
}

/// Reads a value from the bytes of its record. No byte may be left over.
///
/// # Errors
/// [`DesignError::Damaged`] if the checksum does not match the bytes, also if `bytes` is longer or shorter than the
/// record, [`DesignError::Schema`] for a newer schema,
/// [`DesignError::OtherRecord`] if the checksum is valid, but the bytes are not exactly one binary calibration of type `T`,
/// [`DesignError::NoRecord`] if they are no binary calibration.
///
/// ```
/// use stretch_core::{DesignError, record};
///
/// // any value whose first field is the schema
/// let mut buffer = [0; 64];
/// let bytes = record::store(&(record::SCHEMA, 1.5f64), &mut buffer)?;
/// assert_eq!(record::load::<(u32, f64)>(bytes)?, (record::SCHEMA, 1.5));
/// let mut damaged = bytes.to_vec();
/// damaged[3] ^= 0x10;
/// assert!(matches!(record::load::<(u32, f64)>(&damaged), Err(DesignError::Damaged { .. })));
/// damaged.push(0); // a byte too many
/// assert!(matches!(record::load::<(u32, f64)>(&damaged), Err(DesignError::Damaged { .. })));
/// assert_eq!(record::load::<(u32, f64, f64)>(bytes), Err(DesignError::OtherRecord));
/// assert_eq!(record::load::<(u32, f64)>(&[0xff; 64]), Err(DesignError::NoRecord)); // erased memory
/// # Ok::<(), DesignError>(())
/// ```
pub fn load<'r, T: Deserialize<'r>>(bytes: &'r [u8]) -> Result<T, DesignError> {
    let body = body(bytes)?;
    match postcard::take_from_bytes(body) {
        Ok((value, [])) => Ok(value),
        _ if body.len() < bytes.len() => Err(DesignError::OtherRecord),
        _ => Err(DesignError::NoRecord),
    }
}

/// Checks the checksum at the end of a binary calibration and returns it; `None` for schema 1.
///
/// # Errors
/// The errors of [`load`], except that the bytes of the value are not checked.
pub fn seal(bytes: &[u8]) -> Result<Option<u32>, DesignError> {
    let body = body(bytes)?;
    Ok((body.len() < bytes.len()).then(|| checksum(body)))
}

/// Checks the checksum and the schema, and returns the bytes before the checksum.
fn body(bytes: &[u8]) -> Result<&[u8], DesignError> {
    let (found, _) = postcard::take_from_bytes::<u32>(bytes).map_err(|_| DesignError::NoRecord)?;
    if found == 1 {
        return Ok(bytes);
    }
    let Some((body, seal)) = bytes.split_last_chunk::<SEAL>() else {
        return Err(DesignError::NoRecord);
    };
    let (stored, computed) = (u32::from_le_bytes(*seal), checksum(body));
    if stored != computed {
        return Err(DesignError::Damaged { stored, computed });
    }
    if found > SCHEMA {
        return Err(DesignError::Schema { found, newest: SCHEMA });
    }
    Ok(body)
}
