//! Records as bytes under a seal: what a board carries in flash.
//!
//! ```text
//! record = postcard(value), then CRC-32C of those bytes, least byte first
//! ```
//!
//! The first field of every record is its schema. Schema 1 had no seal: such a record is still
//! read, and refused like any other where bytes are left over. The checksum is Castagnoli's
//! (Koopman, DSN 2002): it finds every error of up to three bits, in records below 655 bytes of
//! up to five, every burst of up to 32 bits, and lets one other damage in 2^32 through.
//!
//! A seal says that the bytes are those that were written, not that their author meant well.

use crc::{CRC_32_ISCSI, Crc, NoTable};
use serde::{Deserialize, Serialize};

use crate::DesignError;

/// The schema of the records that this release writes, of all kinds.
pub const SCHEMA: u32 = crate::CALIBRATION_SCHEMA;

/// Without a table: a kilobyte of flash for a few thousand instructions when the board starts.
const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);

/// Bytes of a seal.
const SEAL: usize = 4;

/// CRC-32C of bytes.
///
/// ```
/// // the check value of the catalogue of CRC algorithms
/// assert_eq!(stretch_core::record::checksum(b"123456789"), 0xe306_9283);
/// ```
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Writes a value and its seal to the beginning of `buffer`; gives what was written.
///
/// # Errors
/// [`DesignError::TooLarge`] where the buffer is too small.
pub fn store<'b, T: Serialize>(value: &T, buffer: &'b mut [u8]) -> Result<&'b [u8], DesignError> {
    let most = buffer.len();
    let full = DesignError::TooLarge { field: "record in bytes", asked: most + 1, most };
    let body = postcard::to_slice(value, buffer).map_err(|_| full)?;
    let (length, seal) = (body.len(), checksum(body).to_le_bytes());
    let place = buffer.get_mut(length..length + SEAL).ok_or(full)?;
    place.copy_from_slice(&seal);
    Ok(&buffer[..length + SEAL])
}

/// A value from the bytes of its record, all of them.
///
/// # Errors
/// [`DesignError::Damaged`] where the seal is not that of the bytes, [`DesignError::Schema`] for
/// a newer record, [`DesignError::NoRecord`] for bytes that are no record of a `T` or more than one.
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
/// # Ok::<(), DesignError>(())
/// ```
pub fn load<'r, T: Deserialize<'r>>(bytes: &'r [u8]) -> Result<T, DesignError> {
    let (value, rest) =
        postcard::take_from_bytes(body(bytes)?).map_err(|_| DesignError::NoRecord)?;
    if rest.is_empty() { Ok(value) } else { Err(DesignError::NoRecord) }
}

/// The seal at the end of a record, once it was found to be that of its bytes; none for schema 1.
///
/// # Errors
/// As [`load`].
pub fn seal(bytes: &[u8]) -> Result<Option<u32>, DesignError> {
    let body = body(bytes)?;
    Ok((body.len() < bytes.len()).then(|| checksum(body)))
}

/// The bytes before the seal.
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
