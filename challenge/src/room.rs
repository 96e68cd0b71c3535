//! Where a case is diagnosed: a folder that holds its data and nothing else.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::Context;
use tempfile::TempDir;

/// A copy of one case's data in a new temporary folder, which is removed on drop.
///
/// The diagnosing process works in it: neither its working folder nor an argument nor its
/// environment leads to the labels. A program that searched for them could still find them, as any
/// program of the same user could.
pub(crate) struct Room {
    dir: TempDir,
    folder: PathBuf,
}

impl Room {
    /// Copies a case's files, except those named in `without`.
    pub(crate) fn of(case: &Path, without: &[&str]) -> anyhow::Result<Self> {
        let dir =
            tempfile::Builder::new().prefix("stretch-").tempdir().context("temporary folder")?;
        let name = case.file_name().map_or_else(|| "case".into(), ToOwned::to_owned);
        let folder = dir.path().join(name);
        let copied = || -> std::io::Result<()> {
            fs::create_dir(&folder)?;
            for entry in fs::read_dir(case)? {
                let entry = entry?;
                let name = entry.file_name();
                // A link might lead out of the case.
                if entry.file_type()?.is_file() && !without.iter().any(|w| name == *w) {
                    fs::copy(entry.path(), folder.join(name))?;
                }
            }
            Ok(())
        };
        copied().with_context(|| format!("{}: it cannot be copied", case.display()))?;
        Ok(Self { dir, folder })
    }

    /// A command that runs in the folder and knows of no other.
    pub(crate) fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.folder).env("PWD", &self.folder).env_remove("OLDPWD");
        // The shell's record of the last command, which contains the folder's name.
        command.env_remove("_");
        command
    }

    /// A file that was written there.
    pub(crate) fn read(&self, file: &str) -> anyhow::Result<String> {
        let path = self.folder.join(file);
        fs::read_to_string(&path).with_context(|| path.display().to_string())
    }

    /// Takes the folder away, and says why not.
    pub(crate) fn close(self) -> anyhow::Result<()> {
        let shown = self.dir.path().display().to_string();
        self.dir.close().with_context(|| format!("{shown}: it cannot be removed"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holds_the_data_and_nothing_else() {
        let check = tempfile::tempdir().unwrap();
        let case = check.path().join("case-000");
        fs::create_dir_all(check.path().join("sealed")).unwrap();
        fs::create_dir(&case).unwrap();
        fs::write(check.path().join("sealed/truth.json"), "{}").unwrap();
        for file in ["dataset.toml", "a.csv", "diagnosis.json"] {
            fs::write(case.join(file), file).unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink("../sealed/truth.json", case.join("link.json")).unwrap();
        let room = Room::of(&case, &["diagnosis.json"]).unwrap();
        let listed = |folder: &Path| {
            let entries = fs::read_dir(folder).unwrap();
            let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
            names.sort();
            names
        };
        assert_eq!(listed(&room.folder), ["a.csv", "dataset.toml"]);
        // The case is the only entry of its folder, and no parent folder belongs to the check.
        let above = room.folder.parent().unwrap();
        assert_eq!(listed(above), ["case-000"]);
        assert!(!room.folder.starts_with(check.path()));
        assert_eq!(room.read("a.csv").unwrap(), "a.csv");
        assert!(room.read("diagnosis.json").is_err());
        let above = above.to_owned();
        room.close().unwrap();
        assert!(!above.exists());
    }
}
