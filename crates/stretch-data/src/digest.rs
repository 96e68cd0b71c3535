//! Digests of files.

use std::io::{self, Read};

use crc::{CRC_32_ISCSI, Crc};

/// CRC-32C, as records have it.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// What a digest begins with.
const KIND: &str = "crc32c ";

/// The digest of a file's bytes: `crc32c`, and eight hexadecimal digits.
///
/// # Errors
/// What the system says.
///
/// ```
/// let digest = stretch_data::digest_of(&b"123456789"[..])?;
/// assert_eq!(digest, "crc32c e3069283");
/// assert!(stretch_data::is_digest(&digest));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn digest_of(mut file: impl Read) -> io::Result<String> {
    let (mut checksum, mut buffer) = (CRC.digest(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(format!("{KIND}{:08x}", checksum.finalize())),
            Ok(n) => checksum.update(&buffer[..n]),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
}

/// Whether a text can be a digest.
pub fn is_digest(text: &str) -> bool {
    let digits = text.strip_prefix(KIND).unwrap_or_default();
    digits.len() == 8 && digits.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}
