//! A data set: a folder of trials and their description in `dataset.toml`.

use std::{
    fmt,
    fs::{self, File},
    io::{self, Read},
    path::{Component, Path, PathBuf},
};

use crc::{CRC_32_ISCSI, Crc};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    DataError, Remarks, RigFile, TomlFile, Trial,
    files::{FileError, write_folder, write_whole},
};

/// The contents of `dataset.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataSet {
    /// Name of the data set.
    pub name: String,
    /// Nominal sample rate, Hz.
    pub rate_hz: f64,
    /// Rig file, relative to the data set's folder. If absent, the built-in rig is used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<String>,
    /// The trials in the order in which they were recorded.
    #[serde(rename = "trial", default, skip_serializing_if = "Vec::is_empty")]
    pub trials: Vec<TrialEntry>,
}

/// One `[[trial]]` of a [`DataSet`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialEntry {
    /// File, relative to the data set's folder.
    pub file: String,
    /// Kind of motion in the trial.
    pub kind: TrialKind,
    /// Opening of the valve, 0..1, if one opening was held during the trial.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub opening: Option<f64>,
    /// Seconds since the gauge was powered and the sleeve first stretched.
    #[serde(default)]
    pub start_s: f64,
    /// Whether the trial may be fitted, or only used for testing.
    pub split: Split,
    /// Digest of the trial's file when the data set was written. Absent for recordings that were
    /// added by hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
}

/// Kind of motion in a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrialKind {
    /// Inlet valve held at one opening, starting from atmospheric pressure.
    Inflation,
    /// Outlet valve held at one opening, starting from full contraction.
    Deflation,
    /// Random segments.
    Arbitrary,
    /// Pairs of pulses.
    Pulses,
    /// Anything else.
    Other,
}

/// What a trial may be used for.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// May be fitted.
    #[default]
    Fit,
    /// Tested on, never fitted.
    Test,
}

/// File name of the description in the data set's folder.
const FILE: &str = "dataset.toml";

impl DataSet {
    /// Reads `dataset.toml` in a folder, checks it as [`DataSet::parse`] does, and checks that the
    /// files it names exist. The crate `stretch-recording` reads the trials themselves.
    ///
    /// # Errors
    /// [`DataError::File`], [`DataError::NotToml`], or [`DataError::Key`] with the key.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self, DataError> {
        let folder = folder.as_ref();
        if folder.is_dir() && !folder.join(FILE).exists() {
            return Err(DataError::no_data_set(folder));
        }
        let file = TomlFile::read(folder.join(FILE))?;
        let set = Self::from_file(&file)?;
        for (key, path) in set.files() {
            if !folder.join(path).is_file() {
                return Err(file.error(&key, format!("there is no file {path} in the folder")));
            }
        }
        Ok(set)
    }

    /// Parses the text of a `dataset.toml`; messages call the file `name`.
    ///
    /// Checks that each file is named once and lies in the folder, that `rate_hz` is above 0, that
    /// openings are within 0..1, and that there is at least one trial. Unknown keys are ignored.
    ///
    /// # Errors
    /// [`DataError::NotToml`], or [`DataError::Key`] with the key.
    ///
    /// ```
    /// use stretch_data::{DataSet, Split};
    /// let text = "name = 'b'\nrate_hz = 100\n[[trial]]\nfile = 'a.csv'\nkind = 'other'\nsplit = 'fit'";
    /// let set = DataSet::parse("dataset.toml", text)?;
    /// assert_eq!(set.entries(Split::Fit).count(), 1);
    /// let error = DataSet::parse("dataset.toml", &text.replace("fit", "fitt")).unwrap_err();
    /// assert_eq!(
    ///     error.to_string(),
    ///     "dataset.toml, row 6, key trial[0].split: \"fitt\" is none of fit, test (did you mean fit?)"
    /// );
    /// # Ok::<(), stretch_data::DataError>(())
    /// ```
    pub fn parse(name: &str, text: &str) -> Result<Self, DataError> {
        Self::from_file(&TomlFile::new(name, text))
    }

    /// Returns the trials of one split, in order.
    pub fn entries(&self, split: Split) -> impl Iterator<Item = &TrialEntry> {
        self.trials.iter().filter(move |entry| entry.split == split)
    }

    /// Returns a sentence with both rates if the rate of a trial's time stamps differs from
    /// [`DataSet::rate_hz`] by more than 5 %.
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
                "dataset.toml has rate_hz = {}, but the time stamps of {} give {stamped_hz:.2} Hz: the time stamps are used; correct \
                 whichever is wrong",
                self.rate_hz, trial.name
            )
        })
    }

    /// Stores the digest of each trial's file in a folder. From then on, loading a trial fails if
    /// its file was replaced, for example by a file of another data set.
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

    /// Writes `dataset.toml` into an existing folder, completely or not at all.
    ///
    /// # Errors
    /// [`DataError::Key`] if the text could not be read back, otherwise as [`write_whole`].
    pub fn write(&self, folder: impl AsRef<Path>) -> Result<(), DataError> {
        let path = folder.as_ref().join(FILE);
        let text = self.to_toml();
        Self::parse(&path.display().to_string(), &text)?;
        Ok(write_whole(path, |out| out.write_all(text.as_bytes()))?)
    }

    /// Writes a folder with `dataset.toml`, the rig file, and each trial as returned by `trial`. Like
    /// [`write_folder`](crate::files::write_folder), it writes the folder completely or not at all.
    ///
    /// # Errors
    /// The errors of [`write_folder`](crate::files::write_folder), and those that `trial` returns.
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

    /// Returns the text of `dataset.toml`.
    pub fn to_toml(&self) -> String {
        Remarks::default().write(self)
    }

    fn from_file(file: &TomlFile) -> Result<Self, DataError> {
        let set: Self = file.parse()?;
        let fail = |key: &str, problem: String| Err(file.error(key, problem));
        if set.rate_hz <= 0.0 {
            return fail("rate_hz", format!("{} is not above 0 samples a second", set.rate_hz));
        }
        if set.trials.is_empty() {
            return fail("trial", "there is no [[trial]]; write a table for each file".into());
        }
        if let Some((key, path)) = set.files().find(|(_, path)| !stands_in_folder(path)) {
            let problem = format!("{path:?} is not in the data set's folder; put the file there");
            return fail(&key, problem);
        }
        for (i, TrialEntry { file, opening, digest, .. }) in set.trials.iter().enumerate() {
            let key = |key: &str| format!("trial[{i}].{key}");
            if let Some(k) = set.trials[..i].iter().position(|other| other.file == *file) {
                return fail(
                    &key("file"),
                    format!("{file} is also the file of trial[{k}]; list each file once"),
                );
            }
            if let Some(opening) = opening.filter(|opening| !(0.0..=1.0).contains(opening)) {
                return fail(&key("opening"), format!("{opening} is not between 0 and 1"));
            }
            if let Some(digest) = digest.as_deref().filter(|digest| !is_digest(digest)) {
                let form = "write crc32c and eight hexadecimal digits, or leave it out";
                return fail(&key("digest"), format!("{digest:?} is not a digest; {form}"));
            }
        }
        Ok(set)
    }

    /// Returns the files that the data set names, each with its key.
    fn files(&self) -> impl Iterator<Item = (String, &str)> {
        let trials = self.trials.iter().enumerate();
        let trials = trials.map(|(i, entry)| (format!("trial[{i}].file"), entry.file.as_str()));
        self.rig.as_deref().map(|rig| ("rig".to_owned(), rig)).into_iter().chain(trials)
    }
}

/// Whether a relative path stays within the folder in which it starts.
fn stands_in_folder(path: &str) -> bool {
    let mut parts = Path::new(path).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Returns the trials of a data set whose files still have the digests with which they were
/// written.
pub(crate) fn unchanged_trials(folder: &Path) -> Vec<PathBuf> {
    let text = fs::read_to_string(folder.join(FILE)).unwrap_or_default();
    let trials = DataSet::parse(FILE, &text).map_or(Vec::new(), |set| set.trials);
    let unchanged = trials.into_iter().filter_map(|trial| {
        let path = folder.join(&trial.file);
        let digest = digest_of(File::open(&path).ok()?).ok()?;
        (trial.digest? == digest).then_some(path)
    });
    unchanged.collect()
}

impl TrialEntry {
    /// If the data set contains the digest of a trial's file, checks that the file has not changed since the data set
    /// was written.
    ///
    /// # Errors
    /// [`DataError::Key`] with the digest found; [`DataError::File`] if the file does not exist.
    pub fn check_file(&self, folder: impl AsRef<Path>) -> Result<(), DataError> {
        let path = folder.as_ref().join(&self.file);
        let found = || File::open(&path).and_then(digest_of);
        let found = || found().map_err(|e| DataError::io(path.display(), "open it", e));
        self.check_digest(&folder.as_ref().join(FILE), found)
    }

    /// Checks the bytes of a trial's file against its digest, as `TrialEntry::check_file` does
    /// for a file in a folder.
    ///
    /// # Errors
    /// [`DataError::Key`] with the digest found.
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
            row: None,
            key: format!("digest of {file}"),
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
}

impl fmt::Display for TrialKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// The checksum CRC-32C, which calibration files use as well.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Prefix of a digest.
const KIND: &str = "crc32c ";

/// Returns the digest of a file's bytes: `crc32c` and eight hexadecimal digits.
///
/// # Errors
/// Errors of reading.
///
/// ```
/// let digest = stretch_data::digest_of(&b"123456789"[..])?;
/// assert_eq!(digest, "crc32c e3069283");
/// assert!(stretch_data::is_digest(&digest));
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn digest_of(mut file: impl Read) -> io::Result<String> {
    let (mut checksum, mut buffer) = (CRC.digest(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok(format!("{KIND}{:08x}", checksum.finalize())),
            Ok(n) => checksum.update(&buffer[..n]),
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e),
        }
    }
}

/// Whether a text has the form of a digest.
pub fn is_digest(text: &str) -> bool {
    let digits = text.strip_prefix(KIND).unwrap_or_default();
    digits.len() == 8 && digits.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}
