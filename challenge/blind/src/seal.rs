//! Seals labels by their hash before a diagnosis, and opens them after it.

use std::{fs, path::Path};

use serde::{Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use crate::{error::BlindError, make::write, truth::Truth};

/// File with the hash of the labels.
pub(crate) const MARK: &str = "seal.sha256";
/// File of the labels in the folder of a check.
const LABELS: &str = "sealed/truth.json";

impl Truth {
    /// Writes the labels to `sealed/truth.json` under `dir`, next to the case folders, and their
    /// SHA-256 to `seal.sha256`; returns the SHA-256, 64 hexadecimal digits.
    ///
    /// # Errors
    /// [`BlindError::Io`] when a file cannot be written.
    pub fn seal(&self, dir: &Path) -> Result<String, BlindError> {
        close(dir, &dir.join(LABELS), LABELS, self)
    }

    /// Opens the labels under `dir` if their hash has not changed. Also returns the hash.
    ///
    /// # Errors
    /// [`BlindError::SealBroken`] if it has; [`BlindError::Io`], [`BlindError::Json`] if a file is
    /// missing or invalid.
    pub fn open(dir: &Path) -> Result<(Self, String), BlindError> {
        open(&dir.join(LABELS), dir)
    }
}

/// Writes labels to a file. Writes name and SHA-256 of this file to `seal.sha256` in the folder `set`, in the
/// format of `sha256sum -c`. Returns the SHA-256.
pub(crate) fn close(
    set: &Path,
    path: &Path,
    name: &str,
    labels: &impl Serialize,
) -> Result<String, BlindError> {
    let text = serde_json::to_string_pretty(labels).map_err(BlindError::json(path))? + "\n";
    write(path, &text)?;
    let sha256 = sha256_hex(text.as_bytes());
    write(&set.join(MARK), &format!("{sha256}  {name}\n"))?;
    Ok(sha256)
}

/// Reads labels if their SHA-256 equals the one in `seal.sha256` in the folder `set`. Also returns the
/// hash.
pub(crate) fn open<T: DeserializeOwned>(
    path: &Path,
    set: &Path,
) -> Result<(T, String), BlindError> {
    let mark = set.join(MARK);
    let bytes = fs::read(path).map_err(BlindError::io(path))?;
    let sealed = fs::read_to_string(&mark).map_err(BlindError::io(&mark))?;
    let sealed = sealed.split_whitespace().next().unwrap_or_default().to_owned();
    let found = sha256_hex(&bytes);
    if found != sealed {
        return Err(BlindError::SealBroken { sealed, found });
    }
    Ok((serde_json::from_slice(&bytes).map_err(BlindError::json(path))?, found))
}

fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_is_the_published_one() {
        // FIPS 180-4, the message "abc".
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(b"abc"), expected);
    }

    #[test]
    fn an_altered_label_breaks_the_seal() {
        let dir = tempfile::tempdir().expect("a temporary folder");
        let truth = Truth { schema: 1, seed: Some(4), cases: Default::default() };
        let sealed = truth.seal(dir.path()).expect("closed");
        assert_eq!(Truth::open(dir.path()).expect("unaltered"), (truth, sealed));
        fs::write(dir.path().join(LABELS), "{ \"schema\": 1, \"cases\": {} }\n").expect("altered");
        assert!(matches!(Truth::open(dir.path()), Err(BlindError::SealBroken { .. })));
    }
}
