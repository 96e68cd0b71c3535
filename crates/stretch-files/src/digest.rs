//! The digest of a file, and which trials of a folder a data set was written with.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
};

use crc::{CRC_32_ISCSI, Crc};
use toml::{Table, Value};

/// CRC-32C, as records have it.
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// What a digest begins with.
const KIND: &str = "crc32c ";

/// CRC-32C of bytes that come in pieces.
///
/// ```
/// let mut checksum = stretch_files::Checksum::default();
/// checksum.take(b"1234");
/// checksum.take(b"56789");
/// assert_eq!(checksum.value(), 0xe306_9283);
/// ```
#[derive(Clone)]
pub struct Checksum(crc::Digest<'static, u32>);

impl Default for Checksum {
    fn default() -> Self {
        Self(CRC.digest())
    }
}

impl std::fmt::Debug for Checksum {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Checksum({:08x})", self.value())
    }
}

impl Checksum {
    /// Takes the next bytes.
    pub fn take(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The checksum of all bytes so far.
    pub fn value(&self) -> u32 {
        self.0.clone().finalize()
    }
}

/// The digest of a file's bytes: `crc32c`, and eight hexadecimal digits.
///
/// # Errors
/// What the system says.
///
/// ```
/// let digest = stretch_files::digest_of(&b"123456789"[..])?;
/// assert_eq!(digest, "crc32c e3069283");
/// assert!(stretch_files::is_digest(&digest));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn digest_of(mut file: impl Read) -> io::Result<String> {
    let (mut checksum, mut buffer) = (Checksum::default(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(format!("{KIND}{:08x}", checksum.value())),
            Ok(n) => checksum.take(&buffer[..n]),
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

/// The files of a folder that its `dataset.toml` has a digest of which is theirs: what the program
/// wrote, and nobody changed.
pub(crate) fn written_trials(folder: &Path) -> BTreeSet<PathBuf> {
    let text = fs::read_to_string(folder.join("dataset.toml")).unwrap_or_default();
    let table: Table = text.parse().unwrap_or_default();
    let trials = table.get("trial").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let own = trials.iter().filter_map(|trial| {
        let file = trial.get("file")?.as_str()?;
        let digest = trial.get("digest")?.as_str()?;
        (digest_of(File::open(folder.join(file)).ok()?).ok()? == digest)
            .then(|| PathBuf::from(file))
    });
    own.collect()
}
