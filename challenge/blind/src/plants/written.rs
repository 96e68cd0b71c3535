//! Text files of a set.

use std::{fs, path::Path};

use crate::error::BlindError;

/// Writes a text, with the folders above it.
pub(super) fn write(path: &Path, text: &str) -> Result<(), BlindError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(BlindError::io(folder))?;
    }
    fs::write(path, text).map_err(BlindError::io(path))
}
