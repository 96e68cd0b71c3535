//! A file's bytes, or those of standard input.

use std::{
    fs,
    io::{self, Read},
    path::Path,
    sync::OnceLock,
};

/// The largest file that is read as one piece, bytes: records, settings and diagnoses have kilobytes.
const LARGEST: u64 = 64 << 20;

/// What came on standard input: it comes once, and may be asked for twice.
static STDIN: OnceLock<Vec<u8>> = OnceLock::new();

/// Reads a file, `-` being standard input. What came there is kept, and a second reader gets the same.
///
/// # Errors
/// What the system says, and a file of more than 64 MiB or a stream that goes on so long.
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
        return bounded(fs::File::open(path)?);
    }
    if let Some(bytes) = STDIN.get() {
        return Ok(bytes.clone());
    }
    let bytes = bounded(io::stdin().lock())?;
    Ok(STDIN.get_or_init(|| bytes).clone())
}

fn bounded(from: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(LARGEST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST {
        let most = LARGEST >> 20;
        return Err(io::Error::other(format!(
            "it is larger than {most} MB, as no file of this kind is"
        )));
    }
    Ok(bytes)
}
