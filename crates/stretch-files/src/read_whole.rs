//! A file's bytes, or those of standard input.

use std::{
    fs,
    io::{self, Read},
    path::Path,
    sync::OnceLock,
};

/// What came on standard input: it comes once, and may be asked for twice.
static STDIN: OnceLock<Vec<u8>> = OnceLock::new();

/// Reads a file, `-` being standard input. What came there is kept, and a second reader gets the same.
///
/// # Errors
/// What the system says.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// std::fs::write(folder.path().join("a"), "b")?;
/// assert_eq!(stretch_files::read_whole(folder.path().join("a"))?, b"b");
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn read_whole(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    let path = path.as_ref();
    if path.as_os_str() != "-" {
        return fs::read(path);
    }
    if let Some(bytes) = STDIN.get() {
        return Ok(bytes.clone());
    }
    let mut bytes = Vec::new();
    io::stdin().lock().read_to_end(&mut bytes)?;
    Ok(STDIN.get_or_init(|| bytes).clone())
}
