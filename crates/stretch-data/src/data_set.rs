//! A folder of trials and what `dataset.toml` says of them.

use std::{
    fmt::Write,
    fs::File,
    path::{Component, Path},
};

use serde::{Deserialize, Serialize};

use stretch_files::{FileError, digest_of, is_digest, write_folder, write_whole};

use crate::{
    DataError, RigFile, TomlFile, TomlView, Trial, nearest,
    toml_text::{number_text, string_text},
};

/// The contents of `dataset.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataSet {
    /// What the data set is called.
    pub name: String,
    /// Nominal samples a second.
    pub rate_hz: f64,
    /// Rig file beside it; the built-in rig when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<String>,
    /// The trials in the order in which they were recorded.
    #[serde(rename = "trial", default)]
    pub trials: Vec<TrialEntry>,
}

/// One `[[trial]]` of a [`DataSet`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialEntry {
    /// File, relative to the data set's folder.
    pub file: String,
    /// What was done in it.
    pub kind: TrialKind,
    /// Opening of the valve, 0..1, where one opening was held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opening: Option<f64>,
    /// Seconds since the gauge was powered and the sleeve first stretched.
    #[serde(default)]
    pub start_s: f64,
    /// Whether it may be fitted or only tested on.
    pub split: Split,
    /// Digest of the file that the data set was written with; what was recorded by hand has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
}

/// What was done in a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrialKind {
    /// Inlet held at one opening, from atmospheric pressure.
    Inflation,
    /// Outlet held at one opening, from full contraction.
    Deflation,
    /// Random segments.
    Arbitrary,
    /// Pairs of pulses.
    Pulses,
    /// Anything else.
    Other,
}

/// What a trial may be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// May be fitted.
    Fit,
    /// Tested on, never fitted.
    Test,
}

/// What the description of a data set is called in its folder.
const FILE: &str = "dataset.toml";

impl DataSet {
    /// Reads `dataset.toml` in a folder and checks it, as [`DataSet::parse`], and that the
    /// files it names are there. Its trials are read by the crate `stretch-recording`.
    ///
    /// # Errors
    /// [`DataError::File`], [`DataError::NotToml`], or [`DataError::Key`] with table and key.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self, DataError> {
        let folder = folder.as_ref();
        if folder.is_dir() && !folder.join(FILE).exists() {
            return Err(DataError::no_data_set(folder));
        }
        let file = TomlFile::read(folder.join(FILE))?;
        let set = Self::from_file(&file)?;
        for (i, entry) in set.trials.iter().enumerate() {
            if !folder.join(&entry.file).is_file() {
                let view = file.top().called(trial_name(i));
                return view.fail("file", format!("there is no file {} in the folder", entry.file));
            }
        }
        if let Some(rig) = set.rig.as_ref().filter(|rig| !folder.join(rig).is_file()) {
            return file.top().fail("rig", format!("there is no file {rig} in the folder"));
        }
        Ok(set)
    }

    /// Parses the text of a `dataset.toml`; `name` stands for the file in messages.
    ///
    /// Each file is named once and stands in the folder, `rate_hz` is above 0, openings are
    /// 0..1, and there is at least one trial. Keys that the format does not know are passed
    /// over.
    ///
    /// # Errors
    /// [`DataError::NotToml`], or [`DataError::Key`] with table and key.
    ///
    /// ```
    /// use stretch_data::{DataSet, Split};
    /// let text = "name = 'b'\nrate_hz = 100\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'fit'";
    /// let set = DataSet::parse("dataset.toml", text)?;
    /// assert_eq!(set.entries(Split::Fit).count(), 1);
    /// let error = DataSet::parse("dataset.toml", &text.replace("fit", "fitt")).unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "dataset.toml, [[trial]] 1, key split: \"fitt\" is none of fit, test (did you mean fit?)"
    /// );
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn parse(name: &str, text: &str) -> Result<Self, DataError> {
        Self::from_file(&TomlFile::parse(name, text)?)
    }

    /// The trials of one split, in order.
    pub fn entries(&self, split: Split) -> impl Iterator<Item = &TrialEntry> {
        self.trials.iter().filter(move |entry| entry.split == split)
    }

    /// A sentence with both where the stamps of a trial say another rate than [`DataSet::rate_hz`], by more than a twentieth.
    ///
    /// ```
    /// use stretch_data::{DataSet, Trial};
    /// let set = DataSet { name: "b".into(), rate_hz: 250.0, rig: None, trials: Vec::new() };
    /// let time_s = (0..50).map(|n| 0.01 * f64::from(n)).collect();
    /// let trial = Trial { name: "a.csv".into(), time_s, ..Trial::default() };
    /// let mismatch = set.rate_mismatch(&trial).expect("they differ");
    /// assert!(mismatch.contains("rate_hz = 250") && mismatch.contains("100.00 Hz"), "{mismatch}");
    /// assert_eq!(DataSet { rate_hz: 100.0, ..set }.rate_mismatch(&trial), None);
    /// ```
    pub fn rate_mismatch(&self, trial: &Trial) -> Option<String> {
        let stamped_hz = trial.rate_hz()?;
        let differs = (stamped_hz / self.rate_hz - 1.0).abs() > 0.05;
        differs.then(|| {
            format!(
                "dataset.toml says rate_hz = {}, the stamps of {} say {stamped_hz:.2} Hz: the stamps are believed; correct \
                 whichever is wrong",
                self.rate_hz, trial.name
            )
        })
    }

    /// The rig file beside it, if it names one.
    ///
    /// # Errors
    /// As [`RigFile::read`].
    pub fn read_rig(&self, folder: impl AsRef<Path>) -> Result<Option<RigFile>, DataError> {
        self.rig.as_ref().map(|rig| RigFile::read(folder.as_ref().join(rig))).transpose()
    }

    /// Takes down the digest of each trial's file in a folder: from then on a trial that was put
    /// there from another data set is refused when it is loaded.
    ///
    /// # Errors
    /// [`DataError::File`] for a file that cannot be read.
    pub fn take_digests(&mut self, folder: impl AsRef<Path>) -> Result<(), DataError> {
        for entry in &mut self.trials {
            let path = folder.as_ref().join(&entry.file);
            let digest = File::open(&path).and_then(digest_of);
            entry.digest = Some(digest.map_err(|e| DataError::io(path.display(), "read it", e))?);
        }
        Ok(())
    }

    /// Writes `dataset.toml` into a folder that exists, whole or not at all.
    ///
    /// # Errors
    /// [`DataError::Key`] when it could not be read back, else as [`write_whole`].
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), DataError> {
        let path = folder.as_ref().join(FILE);
        let text = self.to_toml();
        Self::parse(&path.display().to_string(), &text)?;
        Ok(write_whole(path, |out| out.write_all(text.as_bytes()))?)
    }

    /// Writes a folder with `dataset.toml`, the rig file, and each trial as `trial` makes it,
    /// whole or not at all, as [`write_folder`](stretch_files::write_folder()).
    ///
    /// # Errors
    /// As [`write_folder`](stretch_files::write_folder()), or what `trial` says.
    pub fn write_folder<E: From<DataError> + From<FileError>>(
        &self,
        folder: impl AsRef<Path>,
        force: bool,
        rig: Option<&RigFile>,
        mut trial: impl FnMut(&TrialEntry) -> Result<Trial, E>,
    ) -> Result<(), E> {
        write_folder(folder, force, |new| {
            self.write(new)?;
            if let (Some(rig), Some(name)) = (rig, &self.rig) {
                rig.write(new.join(name))?;
            }
            for entry in &self.trials {
                trial(entry)?.write(new.join(&entry.file))?;
            }
            Ok(())
        })
    }

    /// The text of `dataset.toml`.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        self.write_toml(&mut text).expect("a String takes everything");
        text
    }

    fn write_toml(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "name = {}", string_text(&self.name))?;
        writeln!(out, "rate_hz = {}", number_text(self.rate_hz))?;
        if let Some(rig) = &self.rig {
            writeln!(out, "rig = {}", string_text(rig))?;
        }
        for entry in &self.trials {
            writeln!(out, "\n[[trial]]\nfile = {}", string_text(&entry.file))?;
            writeln!(out, "kind = {}", string_text(entry.kind.name()))?;
            if let Some(opening) = entry.opening {
                writeln!(out, "opening = {}", number_text(opening))?;
            }
            writeln!(out, "start_s = {}", number_text(entry.start_s))?;
            writeln!(out, "split = {}", string_text(entry.split.name()))?;
            if let Some(digest) = &entry.digest {
                writeln!(out, "digest = {}", string_text(digest))?;
            }
        }
        Ok(())
    }

    fn from_file(file: &TomlFile) -> Result<Self, DataError> {
        let top = file.top();
        let rate_hz = top.number("rate_hz")?;
        if rate_hz <= 0.0 {
            return top.fail("rate_hz", format!("{rate_hz} is not above 0 samples a second"));
        }
        let rig = top.optional_text("rig")?.map(str::to_owned);
        if let Some(rig) = rig.as_deref().filter(|rig| !stands_in_folder(rig)) {
            return top.fail("rig", outside(rig));
        }
        let name = top.text("name")?.to_owned();
        let mut set = Self { name, rate_hz, rig, trials: Vec::new() };
        for view in top.tables("trial")? {
            let entry = entry(&view)?;
            if let Some(k) = set.trials.iter().position(|other| other.file == entry.file) {
                let earlier = trial_name(k);
                return view.fail("file", format!("{} is the file of {earlier}, too", entry.file));
            }
            set.trials.push(entry);
        }
        if set.trials.is_empty() {
            return top.fail("trial", "there is no [[trial]]; write a table for each file");
        }
        Ok(set)
    }
}

fn trial_name(index: usize) -> String {
    format!("[[trial]] {}", index + 1)
}

fn entry(view: &TomlView<'_>) -> Result<TrialEntry, DataError> {
    let file = view.text("file")?.to_owned();
    if !stands_in_folder(&file) {
        return view.fail("file", outside(&file));
    }
    let opening = view.optional_number("opening")?;
    if let Some(opening) = opening.filter(|opening| !(0.0..=1.0).contains(opening)) {
        return view.fail("opening", format!("{opening} is not between 0 and 1"));
    }
    let digest = view.optional_text("digest")?.map(str::to_owned);
    if let Some(digest) = digest.as_deref().filter(|digest| !is_digest(digest)) {
        let form = "write crc32c and eight hexadecimal digits, or leave it out";
        return view.fail("digest", format!("{digest:?} is no digest; {form}"));
    }
    Ok(TrialEntry {
        digest,
        file,
        kind: choice(view, "kind", &TrialKind::ALL, TrialKind::name)?,
        opening,
        start_s: view.optional_number("start_s")?.unwrap_or(0.0),
        split: choice(view, "split", &Split::ALL, Split::name)?,
    })
}

fn choice<T: Copy>(
    view: &TomlView<'_>,
    key: &str,
    all: &[T],
    name: fn(T) -> &'static str,
) -> Result<T, DataError> {
    let text = view.text(key)?;
    let names: Vec<&str> = all.iter().map(|&item| name(item)).collect();
    if let Some(i) = names.iter().position(|n| *n == text) {
        return Ok(all[i]);
    }
    let meant = nearest(text, names.iter().copied())
        .map_or(String::new(), |other| format!(" (did you mean {other}?)"));
    view.fail(key, format!("{text:?} is none of {}{meant}", names.join(", ")))
}

/// Whether a path can only lead to something inside the folder that it starts from.
fn stands_in_folder(path: &str) -> bool {
    let mut parts = Path::new(path).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

fn outside(path: &str) -> String {
    format!("{path:?} does not stand in the data set's folder; put the file there")
}

impl TrialEntry {
    /// Refuses a file that is not the one that the data set was written with, where that is known.
    ///
    /// # Errors
    /// [`DataError::Key`] with both digests; [`DataError::File`] where there is no such file.
    pub fn check_file(&self, folder: impl AsRef<Path>) -> Result<(), DataError> {
        let path = folder.as_ref().join(&self.file);
        let found = || File::open(&path).and_then(digest_of);
        let found = || found().map_err(|e| DataError::io(path.display(), "open it", e));
        self.check_digest(&folder.as_ref().join(FILE), found)
    }

    /// The same of the bytes of a file that stands in no folder.
    ///
    /// # Errors
    /// [`DataError::Key`] with both digests.
    pub fn check_bytes(&self, bytes: &[u8]) -> Result<(), DataError> {
        let found = || digest_of(bytes).map_err(|e| DataError::io(&self.file, "read it", e));
        self.check_digest(Path::new(FILE), found)
    }

    fn check_digest(
        &self,
        description: &Path,
        found: impl FnOnce() -> Result<String, DataError>,
    ) -> Result<(), DataError> {
        let Some(written) = &self.digest else { return Ok(()) };
        let found = found()?;
        if found == *written {
            return Ok(());
        }
        let file = &self.file;
        Err(DataError::Key {
            file: description.display().to_string(),
            table: format!("the [[trial]] of {file}"),
            key: "digest".to_owned(),
            problem: format!(
                "{file} is not the file that this data set was written with ({found}): files of two data sets may be mixed in this folder; write it anew, or remove this line if {file} was changed on purpose"
            ),
        })
    }
}

impl TrialKind {
    /// All kinds.
    pub const ALL: [Self; 5] =
        [Self::Inflation, Self::Deflation, Self::Arbitrary, Self::Pulses, Self::Other];

    /// What it is called in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inflation => "inflation",
            Self::Deflation => "deflation",
            Self::Arbitrary => "arbitrary",
            Self::Pulses => "pulses",
            Self::Other => "other",
        }
    }
}

impl Split {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Fit, Self::Test];

    /// What it is called in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Test => "test",
        }
    }
}
