//! A problem as a file: `problem.toml`.

mod entries;
mod keys;
mod schema;
mod simulator;
mod write;

use std::path::{Path, PathBuf};

use stretch_data::{DataError, SessionTrial, TomlFile, TomlView};
use stretch_recording::{ReadOptions, Recording, TimeUnit};

use crate::{
    black_box::spec::{ProblemSpec, Sensor},
    error::ProblemError,
    worker::WorkersSpec,
};
use entries::{effect, input, parameter, stage, trial, wrapped};
use keys::TOP;

pub use entries::TrialFile;
pub use schema::{problem_reference, problem_schema};
pub use simulator::{SimulatorEntry, WorkersEntry};

/// The contents of a `problem.toml`.
///
/// ```
/// use stretch_problem::{ProblemFile, SimulatorEntry};
/// let text = r#"
/// simulator = ["python3", "servo.py"]
/// wrap = ["input.delay", "output.backlash"]
/// [[stage]]
/// name = "servo"
/// output = "angle_deg"
/// inputs = ["command_V"]
/// [[parameter]]
/// name = "gain"
/// value = 10
/// tolerance = "10 %"
/// [[trial]]
/// file = "monday.csv"
/// "#;
/// let file = ProblemFile::parse("problem.toml", text)?;
/// assert_eq!(file.spec.parameters[0].name, "gain");
/// assert!(matches!(file.simulator, SimulatorEntry::Command { .. }));
/// let error = ProblemFile::parse("problem.toml", &text.replace("tolerance", "tolerence")).unwrap_err();
/// assert!(error.to_string().starts_with(
///     "problem.toml, [[parameter]] gain, key tolerence: nothing reads it (did you mean tolerance?)"
/// ));
/// # Ok::<(), stretch_problem::ProblemError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ProblemFile {
    /// Name of the problem.
    pub name: String,
    /// Folder that its files are relative to.
    pub folder: PathBuf,
    /// The simulator.
    pub simulator: SimulatorEntry,
    /// All other entries, without the recordings.
    pub spec: ProblemSpec,
    /// The recordings.
    pub trials: Vec<TrialFile>,
    /// Column of the time.
    pub time: String,
    /// What the time counts, where the name of its column does not say.
    pub time_unit: Option<TimeUnit>,
    /// Greatest number of runs of the simulator.
    pub budget: Option<usize>,
}

/// Name of a problem's file in a folder.
pub(crate) const IN_FOLDER: &str = "problem.toml";
/// The current folder.
const HERE: &str = ".";

impl ProblemFile {
    /// Reads a problem's file.
    ///
    /// # Errors
    /// Files that cannot be read, text that is no TOML, and [`DataError::Key`] with table and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ProblemError> {
        let path = path.as_ref();
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        let beside = folder.unwrap_or_else(|| Path::new(HERE));
        let file = Self::from_file(&TomlFile::read(path)?)?;
        let folder = match file.folder == Path::new(HERE) {
            true => beside.to_owned(),
            false => beside.join(&file.folder),
        };
        Ok(Self { folder, ..file })
    }

    /// Reads the problem's file that a path stands for: the path itself where it ends in `.toml`, or the `problem.toml` of a folder that is
    /// no data set. None where the path stands for no problem's file.
    ///
    /// # Errors
    /// As [`ProblemFile::read`].
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
    /// As [`ProblemFile::read`].
    pub fn parse(file: &str, text: &str) -> Result<Self, ProblemError> {
        Ok(Self::from_file(&TomlFile::parse(file, text)?)?)
    }

    fn from_file(file: &TomlFile) -> Result<Self, DataError> {
        let top = file.top();
        top.only(&TOP.names())?;
        let simulator = SimulatorEntry::of(&top)?;
        let spec = ProblemSpec {
            stages: named(&top, "stage", stage)?,
            inputs: named(&top, "input", input)?,
            parameters: named(&top, "parameter", parameter)?,
            effects: named(&top, "effect", effect)?,
            kinds: Vec::new(),
            wrap: top.texts("wrap")?,
            wrapped: named(&top, "wrapped", wrapped)?,
            without: top.texts("without")?,
            beside: top.texts("beside")?,
            by: None,
            sensor: sensor(&top)?,
            trials: Vec::new(),
        };
        let trials = named(&top, "trial", trial)?;
        let is_builtin =
            matches!(simulator, SimulatorEntry::Rig { .. } | SimulatorEntry::Gauge { .. });
        if !is_builtin {
            if spec.stages.is_empty() {
                return top
                    .fail("stage", "there is no [[stage]]; write one with output and inputs");
            }
            if trials.is_empty() {
                return top.fail(
                    "trial",
                    "there is no [[trial]]; write one with file for each recording",
                );
            }
        }
        Ok(Self {
            name: top.optional_text("name")?.unwrap_or("problem").to_owned(),
            folder: PathBuf::from(top.optional_text("folder")?.unwrap_or(HERE)),
            simulator,
            spec,
            trials,
            time: top.optional_text("time")?.unwrap_or("time_s").to_owned(),
            time_unit: time_unit(&top)?,
            budget: top.optional_count("budget")?,
        })
    }

    /// The workers of the problem's simulator, `jobs` at once where the file gives no number; none for a simulator that is built in.
    ///
    /// # Errors
    /// There is no program that runs FMUs, and the simulator is one.
    pub fn workers(&self, jobs: usize) -> Result<Option<WorkersSpec>, ProblemError> {
        let (spec, how) = match &self.simulator {
            SimulatorEntry::Rig { .. } | SimulatorEntry::Gauge { .. } | SimulatorEntry::Caller => {
                return Ok(None);
            }
            SimulatorEntry::Command { command, workers } => {
                let command: Vec<&str> = command.iter().map(String::as_str).collect();
                (WorkersSpec::new(&command, &self.folder), workers)
            }
            SimulatorEntry::Python { object, workers } => {
                (WorkersSpec::python(object, &self.folder), workers)
            }
            SimulatorEntry::Fmu { file, variables, workers } => {
                let units = units(&self.spec);
                (WorkersSpec::fmu(file, variables, &units, &self.folder)?, workers)
            }
        };
        let jobs = how.jobs.unwrap_or(jobs).max(1);
        Ok(Some(WorkersSpec { jobs, deadline_s: how.deadline_s, start_s: how.start_s, ..spec }))
    }

    /// How recordings of the problem are read.
    pub(crate) fn reading(&self) -> ReadOptions {
        let options = ReadOptions::new().time(&self.time);
        match self.time_unit {
            Some(unit) => options.time_unit(unit),
            None => options,
        }
    }

    /// Reads the recordings; the problem with its recordings.
    ///
    /// # Errors
    /// Recordings that cannot be read.
    pub fn load(&self) -> Result<ProblemSpec, ProblemError> {
        let mut spec = self.spec.clone();
        let options = self.reading();
        for entry in &self.trials {
            let recording = Recording::read(self.folder.join(&entry.file), &options)?;
            let mut trial = SessionTrial::from(recording);
            trial.trial.name.clone_from(&entry.file);
            (trial.start_s, trial.split) = (entry.start_s, entry.split);
            spec.trials.push(trial);
        }
        Ok(spec)
    }
}

/// Units of the time, as they are written.
pub(crate) const TIME_UNITS: [(&str, TimeUnit); 4] = [
    ("s", TimeUnit::Seconds),
    ("ms", TimeUnit::Milliseconds),
    ("us", TimeUnit::Microseconds),
    ("ns", TimeUnit::Nanoseconds),
];

fn time_unit(top: &TomlView<'_>) -> Result<Option<TimeUnit>, DataError> {
    const KEY: &str = "time_unit";
    let Some(text) = top.optional_text(KEY)? else { return Ok(None) };
    match TIME_UNITS.iter().find(|(name, _)| *name == text) {
        Some((_, unit)) => Ok(Some(*unit)),
        None => top.fail(KEY, format!("{text:?} is none of s, ms, us, ns")),
    }
}

/// The columns of reference and signal, where both are named.
fn sensor(top: &TomlView<'_>) -> Result<Option<Sensor>, DataError> {
    match (top.optional_text("reference")?, top.optional_text("signal")?) {
        (Some(reference), Some(signal)) => {
            Ok(Some(Sensor { reference: reference.to_owned(), signal: signal.to_owned() }))
        }
        (None, None) => Ok(None),
        _ => top.fail("reference", "reference and signal go together; give both"),
    }
}

/// Units of parameters and of the values of own effects, by their names for workers.
fn units(spec: &ProblemSpec) -> Vec<(String, &str)> {
    let parameters = spec.parameters.iter().map(|p| (p.name.clone(), p.unit.as_str()));
    let effects = spec.effects.iter().flat_map(|effect| {
        effect.arguments.iter().map(|a| (effect.value_name(a), a.unit.as_str()))
    });
    parameters.chain(effects).filter(|(_, unit)| !unit.is_empty()).collect()
}

/// Every table of one kind; messages call a table by its name where it has one.
fn named<T>(
    top: &TomlView<'_>,
    kind: &str,
    read: fn(&TomlView<'_>) -> Result<T, DataError>,
) -> Result<Vec<T>, DataError> {
    let one = |view: TomlView<'_>| {
        let own = ["name", "file", "column"].iter().find_map(|key| view.text(key).ok());
        match own {
            Some(own) => read(&view.called(format!("[[{kind}]] {own}"))),
            None => read(&view),
        }
    };
    top.tables(kind)?.into_iter().map(one).collect()
}
