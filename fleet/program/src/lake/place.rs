//! Place of a trial: site, rig, sensor and date.

use std::path::{Path, PathBuf};

use anyhow::{bail, ensure};
use chrono::NaiveDate;

/// Columns of the place, in the order of the folders.
pub(crate) const COLUMNS: [&str; 4] = ["site", "rig", "sensor", "date"];

/// Longest name of a site, rig or sensor, such that with its column and its ending as a record it
/// is a valid file name everywhere.
const MOST_LETTERS: usize = 100;

/// Refuses a name that cannot be a folder, or that would lead out of one.
pub(crate) fn check_name(what: &str, name: &str) -> anyhow::Result<()> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    ensure!(
        !name.is_empty()
            && name.len() <= MOST_LETTERS
            && name.chars().all(is_plain)
            && !name.starts_with('.'),
        "{name:?} cannot be a {what}: use letters, digits, -, _ and ., at most {MOST_LETTERS} of them"
    );
    Ok(())
}

/// The partition of a trial.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Place {
    pub site: String,
    pub rig: String,
    pub sensor: String,
    pub date: NaiveDate,
}

impl Place {
    /// Names that can be those of folders, and a date as 2026-11-21 or 20261121.
    pub(crate) fn new([site, rig, sensor, date]: [&str; 4]) -> anyhow::Result<Self> {
        for (what, name) in COLUMNS.iter().zip([site, rig, sensor]) {
            check_name(what, name)?;
        }
        let forms = ["%Y-%m-%d", "%Y%m%d"];
        let read = forms.iter().find_map(|form| NaiveDate::parse_from_str(date, form).ok());
        let Some(date) = read else {
            bail!("{date:?} is no date: write 2026-11-21 or 20261121");
        };
        let [site, rig, sensor] = [site, rig, sensor].map(str::to_owned);
        Ok(Self { site, rig, sensor, date })
    }

    /// Folder below `trials`.
    pub(crate) fn folder(&self) -> PathBuf {
        let Self { site, rig, sensor, date } = self;
        PathBuf::from(format!("site={site}/rig={rig}/sensor={sensor}/date={date}"))
    }

    /// The place that a path below `trials` names.
    pub(crate) fn of(path: &Path) -> anyhow::Result<Self> {
        let mut folders = path.components().map(|c| c.as_os_str().to_string_lossy());
        let mut values = [const { String::new() }; 4];
        for (value, column) in values.iter_mut().zip(COLUMNS) {
            let folder = folders.next().unwrap_or_default();
            let named = folder.strip_prefix(column).and_then(|rest| rest.strip_prefix('='));
            let Some(named) = named else {
                bail!("it stands in no folder site=../rig=../sensor=../date=..")
            };
            *value = named.to_owned();
        }
        ensure!(folders.count() == 1, "it stands in no folder site=../rig=../sensor=../date=..");
        Self::new([&values[0], &values[1], &values[2], &values[3]])
    }

    /// The sensor, whatever the day.
    pub(crate) fn gauge(&self) -> [&str; 3] {
        [&self.site, &self.rig, &self.sensor]
    }

    pub(crate) fn month(&self) -> String {
        self.date.format("%Y-%m").to_string()
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}/{} of {}", self.site, self.rig, self.sensor, self.date)
    }
}
