//! Files dropped on the page: recordings, and the files that describe how they belong together.

use serde::{Deserialize, Serialize};
use stretch_data::{DataSet, RigFile, SessionTrial, Split, Trial, unit};
use stretch_recording::{ReadOptions, Recording, TimeColumn};
use stretch_sleeve::GaugeCalibration;

use crate::{
    Read,
    said::{Said, in_page},
};

/// Reading options for recordings that are not self-describing. Empty texts select the defaults.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct Asked {
    /// The time column, with its unit or the order of its dates behind a colon: see [`TimeColumn`].
    time: String,
    time_unit: String,
    columns: String,
    sample_rate_hz: Option<f64>,
    /// Columns that must exist and contain only numbers.
    require: Vec<String>,
}

impl Asked {
    fn options(&self) -> Result<ReadOptions, Said> {
        let time = if self.time.is_empty() { "time_s" } else { &self.time };
        let time = match self.time_unit.as_str() {
            "" => time.to_owned(),
            unit => format!("{time}:{unit}"),
        };
        let options = time.parse::<TimeColumn>().map_err(Said)?.options();
        let mut options = self.require.iter().fold(options, |o, name| o.require(name));
        if !self.columns.is_empty() {
            options = options.columns(self.columns.split(',').map(str::trim));
        }
        Ok(match self.sample_rate_hz {
            Some(hz) => options.sample_rate_hz(hz),
            None => options,
        })
    }
}

/// Description of a recording for the page.
#[derive(Debug, Serialize)]
pub(crate) struct About {
    name: String,
    rows: usize,
    seconds: f64,
    rate_hz: Option<f64>,
    columns: Vec<Column>,
    notes: Vec<String>,
}

#[derive(Debug, Serialize)]
struct Column {
    name: String,
    unit: String,
    least: f64,
    greatest: f64,
}

impl About {
    fn of(name: &str, Recording { trial, notes }: &Recording) -> Self {
        let column = |channel: &stretch_data::Channel| Column {
            name: channel.name.clone(),
            unit: unit(&channel.name).unwrap_or_default().to_owned(),
            least: channel.values.iter().copied().fold(f64::INFINITY, f64::min),
            greatest: channel.values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        };
        Self {
            name: name.to_owned(),
            rows: trial.len(),
            seconds: trial.duration_s(),
            rate_hz: trial.rate_hz(),
            columns: trial.channels.iter().map(column).collect(),
            notes: notes.iter().map(|note| in_page(note)).collect(),
        }
    }
}

/// All files read so far.
#[derive(Debug, Default)]
pub(crate) struct Files {
    set: Option<DataSet>,
    rigs: Vec<(String, RigFile)>,
    recordings: Vec<(String, Recording)>,
    /// The calibration file that was read last.
    record: Option<(String, GaugeCalibration)>,
    /// Names of recordings used only for testing, if there is no `dataset.toml`.
    held: Vec<String>,
}

impl Files {
    /// Reads a file. It replaces an earlier one with the same name.
    pub(crate) fn take(&mut self, name: &str, bytes: &[u8], asked: &Asked) -> Result<Read, Said> {
        if name.ends_with(".toml") {
            return self.take_toml(name, bytes);
        }
        if name.ends_with(".json") {
            return self.take_record(name, text(name, bytes)?);
        }
        let entry = self.set.iter().flat_map(|set| &set.trials).find(|entry| entry.file == name);
        let recording = match entry {
            Some(entry) => Recording::of_bytes(entry, bytes, &asked.options()?)?,
            None => Recording::from_reader(bytes, name, &asked.options()?)?,
        };
        let about = About::of(name, &recording);
        self.recordings.retain(|(other, _)| other != name);
        self.recordings.push((name.to_owned(), recording));
        Ok(Read::Recording(about))
    }

    fn take_record(&mut self, name: &str, text: &str) -> Result<Read, Said> {
        let gauge = GaugeCalibration::from_json(text, name)?;
        let spec = gauge.calibration().spec();
        let read = Read::Record {
            name: name.to_owned(),
            signal: spec.signal.as_str().to_owned(),
            reference: spec.reference.as_str().to_owned(),
            rate_hz: spec.sample_rate_hz.hz(),
        };
        self.record = Some((name.trim_end_matches(".json").to_owned(), gauge));
        Ok(read)
    }

    /// Returns the calibration file that was read last, with its name.
    pub(crate) fn record(&self) -> Result<&(String, GaugeCalibration), Said> {
        let none = || Said("there is no calibration file: drop one".to_owned());
        self.record.as_ref().ok_or_else(none)
    }

    /// Returns the trials on which a calibration file is evaluated: those used only for testing, or all recordings if
    /// nothing says which these are.
    pub(crate) fn evaluated(&self) -> Result<Vec<Trial>, Said> {
        if self.set.is_some() || !self.held.is_empty() {
            return self.trials(Split::Test);
        }
        Ok(self.session()?.into_iter().map(|one| one.trial).collect())
    }

    /// Returns a recording by its name.
    pub(crate) fn recording(&self, name: &str) -> Result<&Trial, Said> {
        let found = self.recordings.iter().find(|(own, _)| own == name);
        let none = || Said(format!("{name}: there is no recording with this name"));
        found.map(|(_, recording)| &recording.trial).ok_or_else(none)
    }

    fn take_toml(&mut self, name: &str, bytes: &[u8]) -> Result<Read, Said> {
        let text = text(name, bytes)?;
        if name == "problem.toml" {
            return Err(Said(format!(
                "{name}: the page cannot run a simulator of your own; use the program: stretch diagnose {name}"
            )));
        }
        if name == "dataset.toml" {
            let set = DataSet::parse(name, text)?;
            let trials = set.trials.len();
            self.set = Some(set);
            return Ok(Read::DataSet { name: name.to_owned(), trials });
        }
        let rig = RigFile::parse(name, text)?;
        let gauge = is_gauge(&rig);
        self.rigs.retain(|(other, _)| other != name);
        self.rigs.push((name.to_owned(), rig));
        Ok(Read::Rig { name: name.to_owned(), gauge })
    }

    /// Returns a name for the data.
    pub(crate) fn name(&self) -> String {
        match (&self.set, self.recordings.as_slice()) {
            (Some(set), _) => set.name.clone(),
            (None, [(name, _)]) => name.clone(),
            (None, [(first, _), others @ ..]) => format!("{first} and {} more", others.len()),
            (None, []) => String::new(),
        }
    }

    /// Returns the rig file with which a diagnosis of the whole rig, or of the gauge `alone`, begins: the one that
    /// `dataset.toml` names, otherwise the last one of this kind that was read.
    pub(crate) fn rig(&self, alone: bool) -> Result<Option<&RigFile>, Said> {
        if let Some(name) = self.rig_of_set() {
            let named = self.rigs.iter().find(|(own, _)| own == name);
            let (_, rig) = named.ok_or_else(|| missing(name))?;
            if !alone || is_gauge(rig) {
                return Ok(Some(rig));
            }
        }
        let mut rigs = self.rigs.iter().rev().map(|(_, rig)| rig);
        Ok(rigs.find(|rig| is_gauge(rig) == alone))
    }

    fn rig_of_set(&self) -> Option<&String> {
        self.set.as_ref().and_then(|set| set.rig.as_ref())
    }

    /// Returns a sentence for each rig file: whether a diagnosis uses it.
    pub(crate) fn rig_notes(&self) -> Vec<String> {
        let note = |(name, rig): &(String, RigFile)| {
            let alone = is_gauge(rig);
            match (self.rig(alone), self.rig_of_set()) {
                (Ok(Some(used)), _) if std::ptr::eq(used, rig) => {
                    let what = if alone { "the gauge alone" } else { "the whole rig" };
                    format!("{name}: a diagnosis of {what} begins with this rig file")
                }
                (_, Some(own)) => {
                    format!("{name}: it is not used, because dataset.toml names the rig file {own}")
                }
                _ => format!("{name}: it is not used, because another rig file was read after it"),
            }
        };
        self.rigs.iter().map(note).collect()
    }

    /// Returns all trials: those listed in `dataset.toml`, otherwise all recordings.
    pub(crate) fn session(&self) -> Result<Vec<SessionTrial>, Said> {
        let all = || self.recordings.iter();
        match &self.set {
            None => Ok(all().map(|(name, recording)| self.trial(name, recording)).collect()),
            Some(set) => Recording::session_by(set, |entry| {
                let found = all().find(|(name, _)| *name == entry.file);
                found.map(|(_, one)| one.clone()).ok_or_else(|| missing(&entry.file))
            }),
        }
    }

    fn trial(&self, name: &String, recording: &Recording) -> SessionTrial {
        let trial = SessionTrial::from(recording.clone());
        let split = if self.held.contains(name) { Split::Test } else { trial.split };
        SessionTrial { split, ..trial }
    }

    /// Reserves these recordings for testing, so that they are not fitted.
    pub(crate) fn hold(&mut self, names: Vec<String>) {
        self.held = names;
    }

    /// Returns the trials that may be fitted, or those used only for testing.
    pub(crate) fn trials(&self, split: Split) -> Result<Vec<Trial>, Said> {
        let session = self.session()?.into_iter();
        Ok(session.filter(|one| one.split == split).map(|one| one.trial).collect())
    }

    /// Returns at most `most` evenly spaced rows of a recording, as a flat list of time and two
    /// columns.
    pub(crate) fn points(&self, name: &str, columns: [&str; 2], most: usize) -> Vec<f64> {
        let Ok(trial) = self.recording(name) else { return Vec::new() };
        let [a, b] = columns.map(|column| trial.channel(column).unwrap_or(&[]));
        let at = |column: &[f64], i: usize| column.get(i).copied().unwrap_or(f64::NAN);
        let step = trial.len().div_ceil(most.max(1)).max(1);
        let rows = (0..trial.len()).step_by(step);
        rows.flat_map(|i| [trial.time_s[i], at(a, i), at(b, i)]).collect()
    }
}

fn is_gauge(rig: &RigFile) -> bool {
    rig.kind.as_deref() == Some("gauge")
}

fn missing(file: &str) -> Said {
    Said(format!("dataset.toml names {file}, but it was not dropped: drop it, too"))
}

fn text<'a>(name: &str, bytes: &'a [u8]) -> Result<&'a str, Said> {
    std::str::from_utf8(bytes).map_err(|_| Said(format!("{name}: it is not UTF-8 text")))
}
