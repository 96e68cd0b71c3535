//! Input of the demo: a data set, a folder of sessions, or published files.

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail, ensure};
use stretch_data::{DataSet, SessionTrial, Split, Trial, TrialEntry, TrialKind, column_meant};
use stretch_problem::{GaugeSetup, GaugeSimulator, Problem, Reading, name_of};
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::Catalogue;

use super::published::{self, COMMIT, REPOSITORY};
use crate::commands::shared::short_name;

/// Columns of the reference that need not be named; the first existing one is used.
const REFERENCES: [&str; 2] = ["length_mm", "angle_deg"];
const SIGNAL: &str = "bridge_v";
/// Columns that are neither reference nor signal.
const OTHERS: [&str; 3] = ["inlet", "outlet", "pressure_kpa"];

/// Trials to fit and to test on.
pub(super) struct Sessions {
    /// Name of the data.
    pub(super) name: String,
    /// Column of the reference.
    pub(super) reference: String,
    /// Columns among which the signal is chosen.
    pub(super) signals: Vec<String>,
    /// Trials that may be fitted.
    pub(super) fit: Vec<(TrialKind, Trial)>,
    /// Trials used for testing.
    pub(super) test: Vec<(TrialKind, Trial)>,
    /// Notes on the origin of the data.
    pub(super) notes: Vec<String>,
    /// Folder of the data set, if the input is one.
    folder: Option<PathBuf>,
}

impl Sessions {
    /// Reads one of four kinds of input: a folder with a `dataset.toml`; a folder of CSV files, in
    /// which files that differ only in a final `_1`, `_2`, ... form a group; one such group by its
    /// name; or one file with several sessions.
    ///
    /// # Errors
    /// Files that cannot be read; no session to test on; a reference or signal that has to be
    /// named.
    pub(super) fn read(
        path: &Path,
        reference: Option<&str>,
        signal: Option<&str>,
    ) -> anyhow::Result<Self> {
        let (path, group) = match path.parent() {
            Some(folder) if !path.exists() && has_groups(folder) => (folder, path.file_name()),
            _ => (path, None),
        };
        ensure!(
            path.exists(),
            "{}: there is no such folder; the sessions of a knee in a knitted sleeve are public: \
             {REPOSITORY}, commit {COMMIT}, data/Regression",
            path.display()
        );
        let is_set = path.join("dataset.toml").is_file();
        let (name, fit, test, note) =
            if is_set { data_set(path)? } else { loose(path, group.and_then(OsStr::to_str))? };
        let columns = fit.first().map_or(&[][..], |(_, trial)| trial.channels.as_slice());
        let has = |name: &str| columns.iter().any(|c| c.name == name);
        let usual = || REFERENCES.into_iter().find(|name| has(name));
        let named = || columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
        let full = |name| column_meant(name, columns.iter().map(|c| c.name.as_str()));
        let Some(reference) = reference.or_else(usual).and_then(full) else {
            bail!(
                "--data: name the reference with --reference; the columns of the sessions {name} are {}",
                named()
            );
        };
        let signals: Vec<String> = match signal {
            Some(signal) => vec![full(signal).unwrap_or(signal).to_owned()],
            None if has(SIGNAL) => vec![SIGNAL.to_owned()],
            None => columns
                .iter()
                .map(|c| c.name.clone())
                .filter(|c| c != reference && !OTHERS.contains(&c.as_str()))
                .collect(),
        };
        ensure!(
            signals.iter().all(|signal| has(signal)) && !signals.is_empty(),
            "{name}: name the signal with --signal; the columns are {}",
            named()
        );
        let folder = is_set.then(|| path.to_owned());
        let notes = vec![note];
        Ok(Self { name, reference: reference.to_owned(), signals, fit, test, notes, folder })
    }

    /// Returns the trials to which the calibrations of the published method are fitted: the ramps,
    /// or all trials if there are no ramps.
    pub(super) fn ramps(&self) -> Vec<Trial> {
        let is_ramp = |kind: TrialKind| matches!(kind, TrialKind::Inflation | TrialKind::Deflation);
        let any = self.fit.iter().any(|(kind, _)| is_ramp(*kind));
        let kept = self.fit.iter().filter(|(kind, _)| !any || is_ramp(*kind));
        kept.map(|(_, trial)| trial.clone()).collect()
    }

    /// Returns the diagnosis problem: the rig, or the gauge alone, with its simulator.
    ///
    /// # Errors
    /// Trials that cannot be diagnosed.
    pub(super) fn problem(&self, signal: &str) -> anyhow::Result<Problem> {
        let columns = Some((self.reference.as_str(), signal));
        if let Some(folder) = &self.folder {
            let fit = self.fit.iter().map(|(_, trial)| trial);
            let is_rig = fit.clone().all(|t| t.channel("inlet").or(t.channel("outlet")).is_some());
            let columns = columns.filter(|_| !is_rig);
            let reading = Reading { columns, ..Reading::default() };
            return Ok(Problem::read(folder, &reading)?.named(&self.name));
        }
        // Only the first session is used. Each session has a different zero, and the pause before
        // the next one is unknown.
        let first = self.fit.iter().take(1);
        let trials: Vec<SessionTrial> =
            first.map(|(_, trial)| SessionTrial::new(trial.clone())).collect();
        let setup = GaugeSetup {
            trials: &trials,
            reference: &self.reference,
            signal,
            rig: None,
            catalogue: &Catalogue::default(),
        };
        Ok(Problem::from(GaugeSimulator::new(&setup)?).named(&self.name))
    }
}

/// Name, trials to fit, trials to test on, and a note.
type Parts = (String, Vec<(TrialKind, Trial)>, Vec<(TrialKind, Trial)>, String);

fn data_set(folder: &Path) -> anyhow::Result<Parts> {
    let set = DataSet::read(folder)?;
    let of = |split: Split| -> anyhow::Result<Vec<(TrialKind, Trial)>> {
        let entries = set.entries(split);
        let load = |entry: &TrialEntry| Recording::of_entry(entry, folder, &ReadOptions::new());
        let trials =
            entries.map(|e| Ok((e.kind, load(e)?.trial))).collect::<anyhow::Result<Vec<_>>>()?;
        ensure!(
            !trials.is_empty(),
            "{}: no trial has split = \"{split}\"; the demo needs trials to fit and to test on",
            folder.display()
        );
        Ok(trials)
    };
    let note = format!("The data set {} of {}.", set.name, name_of(folder));
    Ok((name_of(folder), of(Split::Fit)?, of(Split::Test)?, note))
}

/// Whether a folder has groups of sessions and no `dataset.toml`.
fn has_groups(folder: &Path) -> bool {
    folder.is_dir()
        && !folder.join("dataset.toml").exists()
        && groups(folder).is_ok_and(|groups| !groups.is_empty())
}

/// Reads one group of files without a `dataset.toml`. The last session is used for testing.
fn loose(path: &Path, wanted: Option<&str>) -> anyhow::Result<Parts> {
    let groups = groups(path)?;
    let names: Vec<&str> = groups.keys().map(String::as_str).collect();
    let name = match wanted {
        Some(name) => name,
        None => *names.first().with_context(|| {
            format!("{}: there is neither a dataset.toml nor a CSV file", path.display())
        })?,
    };
    let Some(files) = groups.get(name) else {
        bail!(
            "{}: there is no group of sessions {name}; the groups are {}",
            path.display(),
            names.join(", ")
        );
    };
    let mut sessions = Vec::new();
    let mut converted = false;
    for file in files {
        match published::sessions(file)? {
            Some(trials) => {
                converted = true;
                sessions.extend(trials);
            }
            None => sessions.push(Recording::read(file, &ReadOptions::new())?.trial),
        }
    }
    let mut fit: Vec<_> = sessions.into_iter().map(|trial| (TrialKind::Other, trial)).collect();
    let test = fit.pop().into_iter().collect();
    ensure!(
        !fit.is_empty(),
        "{}: {name} is a single session; the demo needs one to fit and another to test on",
        path.display()
    );
    let others: Vec<&str> = names.into_iter().filter(|other| *other != name).collect();
    let mut note = format!(
        "Sessions {name}: the last one is used for testing, and only the first is diagnosed."
    );
    if converted {
        note += &format!(" Read as the authors published them ({REPOSITORY}, commit {COMMIT}).");
    }
    if !others.is_empty() {
        note += &format!(" There are also {} (--data FOLDER/GROUP).", others.join(", "));
    }
    Ok((name.to_owned(), fit, test, note))
}

/// Groups CSV files by their names without a final `_1`, `_2`, ...
fn groups(path: &Path) -> anyhow::Result<BTreeMap<String, Vec<PathBuf>>> {
    let mut files = vec![path.to_owned()];
    if path.is_dir() {
        let entries = fs::read_dir(path).and_then(|entries| {
            entries.map(|entry| entry.map(|e| e.path())).collect::<Result<Vec<_>, _>>()
        });
        files = entries.with_context(|| path.display().to_string())?;
        files.retain(|file| file.extension().is_some_and(|e| e == "csv"));
    }
    files.sort();
    let mut groups = BTreeMap::<String, Vec<PathBuf>>::new();
    for file in files {
        let stem = short_name(&file);
        let group = match stem.rsplit_once('_') {
            Some((group, n)) if n.bytes().all(|b| b.is_ascii_digit()) => group.to_owned(),
            _ => stem,
        };
        groups.entry(group).or_default().push(file);
    }
    Ok(groups)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[ignore = "needs measured data: ../shared/data, or what STRETCH_DATA names; ./ci.sh runs it"]
    fn with_data_files_as_published_hold_the_same_as_files_a_session() {
        let sleeve = testkit::measured::folder("knit_sleeve");
        let folder = tempfile::tempdir().unwrap();
        let own = folder.path().join("sessions");
        fs::create_dir(&own).unwrap();
        let mut text = String::from("\u{feff}");
        for session in ["heel_curl_90_1.csv", "heel_curl_90_2.csv"] {
            fs::copy(sleeve.join(session), own.join(session)).unwrap();
            for line in fs::read_to_string(sleeve.join(session)).unwrap().lines().skip(1) {
                let (_, values) = line.split_once(',').expect("a time and values");
                text += &format!("{values},0.1,-0.9,0.2,1,2,3\r\n");
            }
        }
        let published = folder.path().join("S15_16_HC90.csv");
        fs::write(&published, text).unwrap();
        let [one, other] = [&own, &published].map(|path| Sessions::read(path, None, None).unwrap());
        assert_eq!((&one.reference, &one.signals), (&other.reference, &other.signals));
        for (a, b) in [(&one.fit, &other.fit), (&one.test, &other.test)] {
            assert_eq!((a.len(), b.len()), (1, 1));
            assert_eq!((&a[0].1.time_s, &a[0].1.channels), (&b[0].1.time_s, &b[0].1.channels));
        }
    }
}
