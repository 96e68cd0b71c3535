//! The trials to be added to a lake, and the place of each.

use std::{
    fs,
    path::{Path, PathBuf},
    str::FromStr,
};

use anyhow::{Context, bail};
use regex::Regex;
use stretch_data::{DataSet, Split, TrialEntry, TrialKind};
use stretch_recording::{ReadOptions, Recording, RecordingError};

use crate::lake::{COLUMNS, Place};

/// A pattern for the last parts of a path: `{site}/{rig}/{sensor}/{date}_*.csv`. `*` matches
/// anything within a part. A name or `*` ends at the first occurrence of the text that follows it.
#[derive(Debug, Clone)]
pub(crate) struct Pattern(Regex);

impl FromStr for Pattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (mut pattern, mut rest, mut is_open) = ("(?:^|/)".to_owned(), text, false);
        while let Some(next) = rest.find(['{', '*']) {
            if next == 0 && is_open {
                return Err(format!(
                    "two names in {text:?} have no text between them, so that the end of the first is unknown"
                ));
            }
            pattern += &regex::escape(&rest[..next]);
            is_open = true;
            if let Some(behind) = rest[next..].strip_prefix('*') {
                pattern += "[^/]*?";
                rest = behind;
                continue;
            }
            let (name, behind) = rest[next + 1..]
                .split_once('}')
                .ok_or_else(|| format!("a {{ in {text:?} has no }} after it"))?;
            if !COLUMNS.contains(&name) {
                return Err(format!(
                    "{{{name}}} is not one of {{site}}, {{rig}}, {{sensor}} and {{date}}"
                ));
            }
            let group = format!("(?<{name}>[^/]*?)");
            if pattern.contains(&group) {
                return Err(format!("{{{name}}} occurs twice in {text:?}"));
            }
            pattern += &group;
            rest = behind;
        }
        pattern += &regex::escape(rest);
        Regex::new(&format!("{pattern}$")).map(Self).map_err(|e| e.to_string())
    }
}

impl Pattern {
    /// Returns site, rig, sensor and date from a path, or `None` if the path does not match the
    /// pattern.
    fn read(&self, path: &Path) -> Option<[Option<String>; 4]> {
        let parts: Vec<_> = path.components().map(|c| c.as_os_str().to_string_lossy()).collect();
        let path = parts.join("/");
        let found = self.0.captures(&path)?;
        Some(COLUMNS.map(|column| Some(found.name(column)?.as_str().to_owned())))
    }
}

/// Options that give the places of the trials.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Where {
    /// Site, rig, sensor and date from the end of each path, such as {site}/{rig}/{sensor}/{date}_*.csv
    #[arg(long, value_name = "PATTERN")]
    from_path: Option<Pattern>,
    /// Site of all trials whose path does not contain it
    #[arg(long, default_value = "site")]
    site: String,
    /// Rig of all trials whose path does not contain it
    #[arg(long, default_value = "rig")]
    rig: String,
    /// Sensor of all trials whose path does not contain it
    #[arg(long)]
    sensor: Option<String>,
    /// Date of all trials whose path does not contain it: 2026-11-21
    #[arg(long)]
    date: Option<String>,
}

impl Where {
    fn place(&self, path: &Path) -> anyhow::Result<Place> {
        let found = match &self.from_path {
            None => [const { None }; 4],
            Some(pattern) => match pattern.read(path) {
                Some(found) => found,
                None => bail!("its path does not match the pattern of --from-path"),
            },
        };
        let [site, rig, sensor, date] = found;
        let Some(sensor) = sensor.as_ref().or(self.sensor.as_ref()) else {
            bail!("its sensor is unknown: give --sensor NAME, or --from-path with {{sensor}}")
        };
        let Some(date) = date.as_ref().or(self.date.as_ref()) else {
            bail!("its day is unknown: give --date 2026-11-21, or --from-path with {{date}}")
        };
        let site = site.as_ref().unwrap_or(&self.site);
        Place::new([site, rig.as_ref().unwrap_or(&self.rig), sensor, date])
    }
}

/// A file or an entry of a data set to be read as a trial.
#[derive(Debug)]
pub(crate) struct Source {
    pub path: PathBuf,
    /// The place of the trial, or why it is unknown.
    pub place: anyhow::Result<Place>,
    /// The folder of its data set and its entry in `dataset.toml`.
    entry: Option<(PathBuf, TrialEntry)>,
}

impl Source {
    fn new(path: PathBuf, places: &Where, entry: Option<(PathBuf, TrialEntry)>) -> Self {
        let place = places.place(&path);
        Self { path, place, entry }
    }

    /// Whether the path is a device or a pipe, which may have no end.
    pub(crate) fn is_endless(&self) -> bool {
        fs::metadata(&self.path).is_ok_and(|about| !about.is_file())
    }

    pub(crate) fn kind(&self) -> TrialKind {
        self.entry.as_ref().map_or(TrialKind::Other, |(_, entry)| entry.kind)
    }

    pub(crate) fn split(&self) -> Split {
        self.entry.as_ref().map_or(Split::Fit, |(_, entry)| entry.split)
    }

    pub(crate) fn start_s(&self) -> f64 {
        self.entry.as_ref().map_or(0.0, |(_, entry)| entry.start_s)
    }

    pub(crate) fn read(&self, options: &ReadOptions) -> Result<Recording, RecordingError> {
        match &self.entry {
            Some((folder, entry)) => Recording::of_entry(entry, folder, options),
            None => Recording::read(&self.path, options),
        }
    }
}

/// Returns the trials of some paths: a file is one trial, a folder with a `dataset.toml`
/// contributes its trials, and any other folder every file below it.
pub(crate) fn sources(paths: &[PathBuf], places: &Where) -> anyhow::Result<Vec<Source>> {
    let mut found = Vec::new();
    let mut rest: Vec<PathBuf> = paths.iter().rev().cloned().collect();
    while let Some(path) = rest.pop() {
        if !path.is_dir() {
            found.push(Source::new(path, places, None));
        } else if path.join("dataset.toml").is_file() {
            for entry in DataSet::read(&path)?.trials {
                let file = path.join(&entry.file);
                found.push(Source::new(file, places, Some((path.clone(), entry))));
            }
        } else {
            let mut below = Vec::new();
            for entry in fs::read_dir(&path).with_context(|| path.display().to_string())? {
                let entry = entry?;
                // Temporary files of a killed writer are no trials.
                if !entry.file_name().to_string_lossy().starts_with(".stretch-") {
                    below.push(entry.path());
                }
            }
            below.sort_by(|a, b| b.cmp(a));
            rest.extend(below);
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(pattern: &str, path: &str) -> Option<[Option<String>; 4]> {
        pattern.parse::<Pattern>().unwrap().read(Path::new(path))
    }

    #[test]
    fn a_path_says_where_a_trial_stands() {
        let found =
            read("{site}/{rig}/{sensor}/{date}_*.csv", "/logs/ulm/r2/0042/20260103_a_b.csv");
        let told = ["ulm", "r2", "0042", "20260103"].map(|x| Some(x.to_owned()));
        assert_eq!(found, Some(told));
        let found = read("sleeve-{sensor}-{date}.csv", "sleeve-a-7-2026-01-03.csv").unwrap();
        // The first occurrence of the text after a name ends the name.
        assert_eq!(found[2].as_deref(), Some("a"));
        assert_eq!(found[3].as_deref(), Some("7-2026-01-03"));
        assert_eq!(read("{site}/{sensor}.csv", "ulm/7.npz"), None);
        assert_eq!(read("{site}/{rig}/{sensor}.csv", "r2/7.csv"), None);
    }

    #[test]
    fn a_pattern_that_cannot_be_read_says_why() {
        let refused = |text: &str| text.parse::<Pattern>().unwrap_err();
        assert!(refused("{sensr}.csv").contains("{sensr} is not one of"));
        assert!(refused("{sensor.csv").contains("has no }"));
        assert!(refused("{sensor}{date}.csv").contains("the end of the first is unknown"));
        assert!(refused("{date}/{date}.csv").contains("twice"));
    }
}
