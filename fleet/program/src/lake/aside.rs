//! What is not in the lake, and why.

use std::{fs, path::Path};

use serde::Serialize;

use super::digest;

/// A file that was refused.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Refused {
    /// The file.
    pub file: String,
    /// Why, and what to do.
    pub why: String,
}

/// Writes the sentence of a refused file into `refused/`, a file each: whoever looks there sees what is missing.
pub(crate) fn refuse(lake: &Path, file: &Path, why: &str) -> anyhow::Result<Refused> {
    let refused = Refused { file: file.display().to_string(), why: why.to_owned() };
    let folder = lake.join("refused");
    fs::create_dir_all(&folder)?;
    let text = format!("{}: {why}\n", refused.file);
    stretch_files::write_whole(folder.join(note(file)), |out| out.write_all(text.as_bytes()))?;
    Ok(refused)
}

/// Takes back what was said of a file that is in the lake now.
pub(crate) fn accept(lake: &Path, file: &Path) -> std::io::Result<()> {
    match fs::remove_file(lake.join("refused").join(note(file))) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// A name that stays with the path.
fn note(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let path = file.display().to_string();
    format!("{name}-{}.txt", &digest([path.as_bytes()])[..8])
}
