//! A problem as a file: `problem.toml`.

mod schema;
mod simulator;

use std::path::{Path, PathBuf};

use stretch_data::{DataError, Remarks, RigFile, SessionTrial, TomlFile};
use stretch_recording::{ReadOptions, Recording};

use crate::{black_box::spec::ProblemSpec, error::ProblemError, worker::WorkersSpec};

pub use schema::{problem_reference, problem_schema};
pub use simulator::{BuiltIn, SimulatorEntry};
pub(crate) use simulator::{simulator, simulator_schema};

/// Name of a problem's file in a folder.
pub(crate) const IN_FOLDER: &str = "problem.toml";
/// What is wrong with a rig file in the place of a problem's file.
const RIG: &str = "this file describes a built-in rig or gauge, but a problem file is needed here; to see how much of a new recording \
                   it does not explain, run stretch diagnose NEW --rig with this file";
/// What is wrong with a problem's file without recordings.
const NO_TRIAL: &str = "there is no [[trial]]; write one with file for each recording (or, for stretch plan, the table [plan])";
/// The current folder.
const HERE: &str = ".";

impl ProblemSpec {
    /// Reads a problem's file, without its recordings.
    ///
    /// # Errors
    /// Files that cannot be read, text that is no TOML, and [`DataError::Key`] with the key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ProblemError> {
        let path = path.as_ref();
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        let beside = folder.unwrap_or_else(|| Path::new(HERE));
        let spec = Self::from_file(&TomlFile::read(path)?)?;
        let folder = match spec.folder == Path::new(HERE) {
            true => beside.to_owned(),
            false => beside.join(&spec.folder),
        };
        Ok(Self { folder, ..spec })
    }

    /// Reads the problem's file that a path names: the path itself if it ends in `.toml`, or the
    /// `problem.toml` of a folder that is no data set. `None` if the path names no problem's file.
    ///
    /// # Errors
    /// As [`ProblemSpec::read`].
    pub fn at(path: &Path) -> Result<Option<Self>, ProblemError> {
        let inside = path.join(IN_FOLDER);
        match path {
            path if path.is_dir() && inside.is_file() && !path.join("dataset.toml").exists() => {
                Self::read(inside).map(Some)
            }
            path if path.extension().is_some_and(|end| end == "toml") => Self::read(path).map(Some),
            _ => Ok(None),
        }
    }

    /// Parses the text of a problem's file; `file` is its name in messages.
    ///
    /// # Errors
    /// As [`ProblemSpec::read`].
    pub fn parse(file: &str, text: &str) -> Result<Self, ProblemError> {
        Ok(Self::from_file(&TomlFile::new(file, text))?)
    }

    fn from_file(file: &TomlFile) -> Result<Self, DataError> {
        let fail = |key: &str, problem: &str| Err(file.error(key, problem));
        let mut spec: Self = match file.parse() {
            Ok(spec) => spec,
            Err(error) => {
                let rig: Option<RigFile> = file.parse().ok();
                let stage = rig.and_then(|rig| rig.stages.into_keys().next());
                return stage.map_or(Err(error), |stage| fail(&stage, RIG));
            }
        };
        let Some(simulator) = &spec.simulator else {
            return fail(
                "simulator",
                "it is missing; write simulator = [\"python3\", \"sim.py\"], or a table [simulator]",
            );
        };
        simulator.check().map_err(|(key, problem)| file.error(&key, problem))?;
        if spec.reference.is_some() != spec.signal.is_some() {
            return fail("reference", "reference and signal go together; give both");
        }
        if simulator.builtin.is_none() && spec.stages.is_empty() {
            return fail("stage", "there is no [[stage]]; write one with output and inputs");
        }
        if simulator.builtin.is_none() && spec.files.is_empty() && spec.plan.is_none() {
            return fail("trial", NO_TRIAL);
        }
        for stage in spec.stages.iter_mut().filter(|stage| stage.name.is_empty()) {
            stage.name.clone_from(&stage.output);
        }
        if spec.folder.as_os_str().is_empty() {
            spec.folder = HERE.into();
        }
        Ok(spec)
    }

    /// The text of the file in its own folder. Parsing the text gives the same problem.
    pub fn to_toml(&self) -> String {
        self.to_toml_with(&self.folder.join(IN_FOLDER), &Remarks::default())
    }

    /// The text of the file at `path`, with comments on its entries. Parsing the text gives the
    /// same problem. If the problem's files are not relative to the folder of `path`, the text
    /// names their folder.
    ///
    /// `remarks` holds comments on parameters under the table `parameter`.
    pub fn to_toml_with(&self, path: &Path, remarks: &Remarks) -> String {
        let mut remarks = remarks.clone();
        if self.simulator.is_none() {
            remarks
                .head
                .push("The simulator was an object in memory: add the key simulator.".into());
        }
        remarks.write(&Self { folder: self.folder_from(path).unwrap_or_default(), ..self.clone() })
    }

    /// The folder to which the problem's file names are relative; `None` if it is the folder of
    /// `path`.
    fn folder_from(&self, path: &Path) -> Option<PathBuf> {
        let real = |folder: &Path| match folder.as_os_str().is_empty() {
            true => Path::new(HERE).canonicalize(),
            false => folder.canonicalize(),
        };
        let beside = real(path.parent().unwrap_or(Path::new(HERE)));
        let own = real(&self.folder).unwrap_or_else(|_| self.folder.clone());
        (beside.ok().as_ref() != Some(&own)).then_some(own)
    }

    /// Name in reports.
    pub fn shown_name(&self) -> &str {
        self.name.as_deref().unwrap_or("problem")
    }

    /// The workers (processes) that run the problem's simulator, `jobs` at once if the file gives no number; `None` for
    /// a simulator that is built in.
    ///
    /// # Errors
    /// The simulator is an FMU, and the program that runs FMUs is missing.
    pub fn workers(&self, jobs: usize) -> Result<Option<WorkersSpec>, ProblemError> {
        self.simulator.as_ref().map_or(Ok(None), |own| own.workers(jobs, self))
    }

    /// How recordings of the problem are read.
    pub(crate) fn reading(&self) -> ReadOptions {
        let options = ReadOptions::new().time(self.time.as_deref().unwrap_or("time_s"));
        match self.time_unit {
            Some(unit) => options.time_unit(unit),
            None => options,
        }
    }

    /// Reads the recordings and returns the problem with them.
    ///
    /// # Errors
    /// Recordings that cannot be read.
    pub fn load(&self) -> Result<Self, ProblemError> {
        self.load_as(&self.reading())
    }

    /// As `load`, with other options for reading the recordings.
    pub(crate) fn load_as(&self, options: &ReadOptions) -> Result<Self, ProblemError> {
        if self.files.is_empty() {
            return Err(ProblemError::Refused(format!("trial: {NO_TRIAL}")));
        }
        let mut spec = self.clone();
        for entry in &self.files {
            let recording = Recording::read(self.folder.join(&entry.file), options)?;
            let mut trial = SessionTrial::from(recording);
            trial.trial.name.clone_from(&entry.file);
            (trial.start_s, trial.split) = (entry.start_s, entry.split);
            spec.trials.push(trial);
        }
        Ok(spec)
    }
}
