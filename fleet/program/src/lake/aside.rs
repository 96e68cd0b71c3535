//! What is not in the lake, and why.

use std::{fs, path::Path};

use anyhow::ensure;
use serde::Serialize;

use super::{Lake, digest, open::Unfit};

/// A file that was refused.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Refused {
    /// The file.
    pub file: String,
    /// Why, and what to do.
    pub why: String,
}

/// Writes the error of a refused file into `refused/`, one file each, so that a user finds there
/// what is missing.
pub(crate) fn refuse(lake: &Path, file: &Path, why: &str) -> anyhow::Result<Refused> {
    let refused = Refused { file: file.display().to_string(), why: why.to_owned() };
    let folder = lake.join("refused");
    fs::create_dir_all(&folder)?;
    let text = format!("{}: {why}\n", refused.file);
    stretch_data::files::write_whole(folder.join(note(file)), |out| {
        out.write_all(text.as_bytes())
    })?;
    Ok(refused)
}

/// Removes the refusal of a file that is in the lake now.
pub(crate) fn accept(lake: &Path, file: &Path) -> std::io::Result<()> {
    match fs::remove_file(lake.join("refused").join(note(file))) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// Moves the files that no query could read into `refused/`, under names that hold their former
/// path.
///
/// # Errors
/// If lake.json does not fit more files than it fits, it is wrong rather than the files, and all
/// stay where they are.
pub(crate) fn set_aside(lake: &Lake) -> anyhow::Result<Vec<Refused>> {
    let others: Vec<&Unfit> = lake.unfit.iter().filter(|file| file.is_of_another_lake).collect();
    if let Some(Unfit { path, why, .. }) = others.first() {
        ensure!(
            others.len() <= lake.files.len(),
            "lake.json fits {} of the lake's files and does not fit {}, the first {}: {why}. Nothing was moved: put lake.json \
             right, or take those files out",
            lake.files.len(),
            others.len(),
            path.display()
        );
    }
    let one = |Unfit { path, why, .. }: &Unfit| {
        let stood = path.strip_prefix(lake.folder.join("trials")).unwrap_or(path);
        let name = stood.display().to_string().replace('/', ",");
        let refused = refuse(&lake.folder, path, why)?;
        let folder = lake.folder.join("refused");
        let mut free = folder.join(&name);
        let mut number = 1;
        while free.exists() {
            number += 1;
            free = folder.join(format!("{name}.{number}"));
        }
        fs::rename(path, free)?;
        Ok(refused)
    };
    lake.unfit.iter().map(one).collect()
}

/// A name that stays with the path.
fn note(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let path = file.display().to_string();
    format!("{name}-{}.txt", &digest([path.as_bytes()])[..8])
}
