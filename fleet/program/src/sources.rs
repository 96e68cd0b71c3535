//! Which trials are to be added to a lake, and where each belongs.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use stretch_data::{DataSet, Split, TrialEntry, TrialKind};
use stretch_recording::{ReadOptions, Recording, RecordingError};

use crate::{from_path::Pattern, lake::Place};

/// What is said of the places of all trials.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct Where {
    /// Site, rig, sensor and date from the end of each path, such as {site}/{rig}/{sensor}/{date}_*.csv
    #[arg(long, value_name = "PATTERN")]
    from_path: Option<Pattern>,
    /// Site of all trials whose path does not say it
    #[arg(long, default_value = "site")]
    site: String,
    /// Rig of all trials whose path does not say it
    #[arg(long, default_value = "rig")]
    rig: String,
    /// Sensor of all trials whose path does not say it
    #[arg(long)]
    sensor: Option<String>,
    /// Date of all trials whose path does not say it: 2026-11-21
    #[arg(long)]
    date: Option<String>,
}

impl Where {
    fn place(&self, path: &Path) -> anyhow::Result<Place> {
        let found = match &self.from_path {
            None => [const { None }; 4],
            Some(pattern) => match pattern.read(path) {
                Some(found) => found,
                None => bail!("its path does not fit the pattern of --from-path"),
            },
        };
        let [site, rig, sensor, date] = found;
        let Some(sensor) = sensor.as_ref().or(self.sensor.as_ref()) else {
            bail!(
                "nobody says which sensor it is of: --sensor NAME, or --from-path with {{sensor}}"
            )
        };
        let Some(date) = date.as_ref().or(self.date.as_ref()) else {
            bail!("nobody says of which day it is: --date 2026-11-21, or --from-path with {{date}}")
        };
        let site = site.as_ref().unwrap_or(&self.site);
        Place::new([site, rig.as_ref().unwrap_or(&self.rig), sensor, date])
    }
}

/// A trial as it lies on a disk.
#[derive(Debug)]
pub(crate) struct Source {
    pub path: PathBuf,
    /// Where it belongs, or why that is unknown.
    pub place: anyhow::Result<Place>,
    /// Its line in a dataset.toml, and the folder of that.
    entry: Option<(PathBuf, TrialEntry)>,
}

impl Source {
    fn new(path: PathBuf, places: &Where, entry: Option<(PathBuf, TrialEntry)>) -> Self {
        let place = places.place(&path);
        Self { path, place, entry }
    }

    /// Whether it is a device or a pipe, which may have no end.
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

/// The trials of some paths: a file is one trial, a folder with a dataset.toml gives its trials,
/// any other folder every file below it.
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
                // temporary files of a killed writer are no trials
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
