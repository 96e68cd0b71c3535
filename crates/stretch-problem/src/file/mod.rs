//! A problem as a file: `problem.toml`.

mod entries;
mod simulator;
mod table;

use std::path::{Path, PathBuf};

use stretch_data::{ReadOptions, Recording, SessionTrial};

use crate::{error::ProblemError, spec::ProblemSpec, worker::WorkersSpec};
use entries::{effect, input, parameter, stage, trial};
use table::View;

pub use entries::TrialFile;
pub use simulator::{SimulatorEntry, WorkersEntry};

/// Largest file that is read: people write these.
const LARGEST_BYTES: usize = 4 << 20;

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
    /// What the problem is called.
    pub name: String,
    /// Folder that its files are relative to.
    pub folder: PathBuf,
    /// What simulates.
    pub simulator: SimulatorEntry,
    /// Everything else, the recordings apart.
    pub spec: ProblemSpec,
    /// Recordings.
    pub trials: Vec<TrialFile>,
    /// Column of the time.
    pub time: String,
    /// Most runs of the simulator.
    pub budget: Option<usize>,
}

const TOP: &str = "the top of the file";

impl ProblemFile {
    /// Reads a problem's file.
    ///
    /// # Errors
    /// Files that cannot be read, text that is no TOML, and [`ProblemError::Key`] with table and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ProblemError> {
        let path = path.as_ref();
        let shown = path.display().to_string();
        let fail = |why: String| ProblemError::value(&shown, why, "give a problem.toml");
        let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
        if text.len() > LARGEST_BYTES {
            return Err(fail(format!("it is larger than {LARGEST_BYTES} bytes")));
        }
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        let folder = folder.unwrap_or_else(|| Path::new(".")).to_owned();
        Ok(Self { folder, ..Self::parse(&shown, &text)? })
    }

    /// Parses the text of a problem's file; `file` stands for it in messages.
    ///
    /// # Errors
    /// As [`ProblemFile::read`].
    pub fn parse(file: &str, text: &str) -> Result<Self, ProblemError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
            let upto = e.span().map_or(0, |span| span.start.min(text.len()));
            let row = 1 + text.as_bytes()[..upto].iter().filter(|&&b| b == b'\n').count();
            let message = e.message().split_whitespace().collect::<Vec<_>>().join(" ");
            ProblemError::value(format!("{file}, row {row}"), message, "write TOML there")
        })?;
        let top = View { file, name: TOP, table: &table };
        top.only(&[
            "name",
            "simulator",
            "wrap",
            "beside",
            "time",
            "budget",
            "stage",
            "input",
            "parameter",
            "effect",
            "trial",
        ])?;
        let simulator = SimulatorEntry::of(&top)?;
        let each = |key: &str| -> Result<Vec<_>, ProblemError> {
            Ok(top.tables(key)?.into_iter().enumerate().collect())
        };
        let spec = ProblemSpec {
            stages: named(&top, "stage", each("stage")?, stage)?,
            inputs: named(&top, "input", each("input")?, input)?,
            parameters: named(&top, "parameter", each("parameter")?, parameter)?,
            effects: named(&top, "effect", each("effect")?, effect)?,
            wrap: top.texts("wrap")?,
            beside: top.texts("beside")?,
            trials: Vec::new(),
        };
        let trials = named(&top, "trial", each("trial")?, trial)?;
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
            name: top.text_or("name", "problem")?,
            folder: PathBuf::from("."),
            simulator,
            spec,
            trials,
            time: top.text_or("time", "time_s")?,
            budget: top.optional_count("budget")?,
        })
    }

    /// The workers that answer it, `jobs` at once where the file does not say; none for what is built in.
    ///
    /// # Errors
    /// An FMU where there is no program that runs it.
    pub fn workers(&self, jobs: usize) -> Result<Option<WorkersSpec>, ProblemError> {
        let (spec, how) = match &self.simulator {
            SimulatorEntry::Rig { .. } | SimulatorEntry::Gauge { .. } => return Ok(None),
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

    /// The problem with its recordings.
    ///
    /// # Errors
    /// Recordings that cannot be read.
    pub fn load(&self) -> Result<ProblemSpec, ProblemError> {
        let mut spec = self.spec.clone();
        let options = ReadOptions::new().time(&self.time);
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

/// Units of parameters and of the values of own effects, by the names that workers know them by.
fn units(spec: &ProblemSpec) -> Vec<(String, &str)> {
    let parameters = spec.parameters.iter().map(|p| (p.name.clone(), p.unit.as_str()));
    let effects = spec.effects.iter().flat_map(|effect| {
        effect.arguments.iter().map(|a| (effect.value_name(a), a.unit.as_str()))
    });
    parameters.chain(effects).filter(|(_, unit)| !unit.is_empty()).collect()
}

/// Every table of one kind, called by its name where it has one.
fn named<T>(
    top: &View<'_>,
    kind: &str,
    tables: Vec<(usize, &toml::Table)>,
    read: fn(View<'_>) -> Result<T, ProblemError>,
) -> Result<Vec<T>, ProblemError> {
    let one = |(i, table): (usize, &toml::Table)| {
        let own = ["name", "file", "column"].iter().find_map(|key| table.get(*key)?.as_str());
        let own = own.map_or_else(|| (i + 1).to_string(), str::to_owned);
        read(View { file: top.file, name: &format!("[[{kind}]] {own}"), table })
    };
    tables.into_iter().map(one).collect()
}
