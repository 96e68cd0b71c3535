//! One problem: any simulator with one session of recordings.

use std::{fmt::Debug, num::NonZeroUsize, path::Path, sync::Arc};

use stretch_gap::{Diagnosis, EffectSpec, Evidence, Laboratory, Model, Simulator};
use stretch_recording::ReadOptions;
use stretch_sim::{Catalogue, Sketch};

use crate::{
    black_box::{BlackBox, ProblemSpec},
    error::ProblemError,
    file::IN_FOLDER,
    fix::{Chosen, Fix, NoFix},
    gauge::GaugeSimulator,
    implement::Implementation,
    rig::RigSimulator,
    sensors::read_sensors,
    worker::{Workers, WorkersSpec},
};

/// A simulator with its recordings that provides everything [`Problem::examine`] needs. A new kind
/// of simulator implements this trait.
pub trait Diagnosable: Laboratory + Debug + Send {
    /// Notes on what was done to the recordings and which effects are not looked for, in sentences.
    fn notes(&self) -> Vec<String>;

    /// What may be wrong with the recordings, in sentences.
    fn doubts(&self) -> Vec<String> {
        Vec::new()
    }

    /// Notes that are known only after the diagnosis, in sentences.
    fn afterwards(&self) -> Vec<String> {
        Vec::new()
    }

    /// A recorded column by its name, all trials concatenated.
    fn column(&self, name: &str) -> Option<Vec<f64>>;

    /// What an effect of the catalogue does, in words, and its equation.
    fn in_words(&self, effect: usize) -> [&str; 2];

    /// Code for an effect of the catalogue with these values, in the simulator re-tuned as in a model.
    fn sketch(&self, effect: usize, values: &[f64], model: &Model) -> Option<Sketch>;

    /// Code for the effects that a diagnosis names, for the user to copy into the simulator.
    fn implementations(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Vec<Implementation> {
        let Ok(chosen) = Chosen::of(diagnosis, evidence) else { return Vec::new() };
        let effects = &self.description().spec().effects;
        let one = |(effect, values): (usize, &[f64])| {
            let EffectSpec { name, stage, .. } = &effects[effect];
            let [words, formula] = self.in_words(effect).map(str::to_owned);
            let (name, stage, numbers) = (name.clone(), stage.clone(), chosen.numbers(name));
            let sketch = self.sketch(effect, values, chosen.model);
            Implementation { name, words, stage, formula, numbers, sketch }
        };
        chosen.named(effects).into_iter().map(one).collect()
    }

    /// The fixed simulator, as a file.
    ///
    /// # Errors
    /// [`NoFix`] says why there is no such file.
    fn fixed(&self, diagnosis: &Diagnosis, evidence: &Evidence) -> Result<Fix, NoFix>;
}

/// A simulator with one session of recordings, ready to be [examined](Problem::examine).
#[derive(Debug)]
pub struct Problem {
    /// Name of the data.
    pub name: String,
    source: Box<dyn Diagnosable>,
}

impl<S: Diagnosable + 'static> From<S> for Problem {
    fn from(source: S) -> Self {
        Self { name: "data".to_owned(), source: Box::new(source) }
    }
}

/// How a problem is read from a path.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading<'a> {
    /// Rig file that replaces the rig file of the data set.
    pub rig: Option<&'a Path>,
    /// Names of the reference and signal columns, for a gauge alone (a sensor and its reference, without
    /// the rest of the rig) or for a stage that is a sensor.
    pub columns: Option<(&'a str, &'a str)>,
    /// A column that distinguishes runs ([`Problem::by_column`]), which is read in addition to those of the problem.
    pub by: Option<&'a str>,
    /// Options for reading recordings, which replace the options that the data state.
    pub recorded: Option<&'a ReadOptions>,
    /// Whether a recording with a row that cannot be read is refused ([`ReadOptions::strict`]).
    pub strict: bool,
    /// Effects that are not looked for.
    pub without: &'a [String],
    /// Called before a program runs, with one line that names the program.
    pub announce: Option<fn(&str)>,
}

impl Reading<'_> {
    /// Names the program that a problem's file runs, before it runs.
    pub(crate) fn announce(&self, path: &Path, workers: &WorkersSpec) {
        if let Some(announce) = self.announce {
            let (path, folder) = (path.display(), workers.folder.display());
            let program = workers.shown();
            announce(&format!("{path} runs this program in the folder {folder}: {program}"));
        }
    }
}

impl Problem {
    /// Reads a problem from a path: the folder of a data set, a trial of a gauge alone (`-` is
    /// standard input), or a problem's file. If the simulator is not built in, its workers are
    /// started only if the path names the problem's file. A folder never runs a program.
    ///
    /// # Errors
    /// Files that cannot be read, names that match nothing, options that do not apply to the
    /// simulator, and a folder whose `problem.toml` would run a program.
    pub fn read(path: &Path, reading: &Reading<'_>) -> Result<Self, ProblemError> {
        let Some(file) = ProblemSpec::at(path)? else { return Self::built_in(path, reading) };
        let Some(own) = file.simulator.as_ref().filter(|own| own.builtin.is_some()) else {
            return Self::of_file(path, file, reading);
        };
        let rig = own.rig.as_ref().map(|rig| file.folder.join(rig));
        let data_set = own.data_set.as_deref().unwrap_or(".");
        let own = own.reference.as_deref().zip(own.signal.as_deref());
        let reading = Reading {
            rig: reading.rig.or(rig.as_deref()),
            columns: reading.columns.or(own),
            ..*reading
        };
        Self::built_in(&file.folder.join(data_set), &reading)
    }

    /// Reads a built-in simulator's problem from a data set's folder, or from a trial.
    fn built_in(path: &Path, reading: &Reading<'_>) -> Result<Self, ProblemError> {
        let Reading { rig, columns, .. } = *reading;
        let recorded = reading.recorded.cloned().unwrap_or_default().strict(reading.strict);
        if let Some(several) = columns.filter(|(_, signal)| signal.contains(',')) {
            if rig.is_some() {
                let hint = "diagnose the signals one at a time";
                return Err(ProblemError::value("--rig", "a rig file describes one signal", hint));
            }
            let source = Box::new(read_sensors(path, several, reading.without, recorded)?);
            return Ok(Self { name: name_of(path), source });
        }
        let catalogue = Catalogue::default().without(reading.without)?;
        let source: Box<dyn Diagnosable> = match GaugeSimulator::read(
            path, columns, rig, &catalogue, &recorded,
        )? {
            Some(gauge) => Box::new(gauge),
            None if path.is_dir() => Box::new(RigSimulator::read(path, rig, &catalogue, recorded)?),
            None => {
                let hint = "name its columns with --reference and --signal, or give the folder of a data set";
                return Err(ProblemError::too_little(
                    "a single trial is diagnosed as a gauge alone",
                    hint,
                ));
            }
        };
        Ok(Self { name: name_of(path), source })
    }

    /// Starts the workers of a simulator that is not built in, and binds them to the problem of a file.
    fn of_file(
        path: &Path,
        mut file: ProblemSpec,
        reading: &Reading<'_>,
    ) -> Result<Self, ProblemError> {
        if reading.rig.is_some() {
            let hint = "set the parameters in the problem's file";
            return Err(ProblemError::value(
                "--rig",
                "it works with the built-in simulators only",
                hint,
            ));
        }
        if let Some((reference, signal)) = reading.columns {
            (file.reference, file.signal) = (Some(reference.into()), Some(signal.into()));
        }
        file.by = reading.by.map(str::to_owned);
        file.without.extend(reading.without.iter().cloned());
        let recorded = reading.recorded.cloned().unwrap_or_else(|| file.reading());
        let recorded = recorded.strict(reading.strict);
        let workers = file.workers(1)?;
        let workers =
            workers.ok_or_else(|| ProblemError::Refused("the simulator is built in".into()))?;
        let program = workers.shown();
        if path.is_dir() {
            let inside = path.join(IN_FOLDER);
            let inside = inside.display();
            return Err(ProblemError::Refused(format!(
                "{inside}: it names a program to run ({program}), but no program is run for a folder; if you trust it, give the file itself, {inside}"
            )));
        }
        reading.announce(path, &workers);
        let (checked, source) = Workers::bound(file.load_as(&recorded)?, workers)?;
        let name = file.shown_name().to_owned();
        let own = BlackBox::within(checked, Arc::new(source), file.budget.map(NonZeroUsize::get));
        Ok(Self { name, source: Box::new(own) })
    }

    /// The problem under another name.
    pub fn named(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The simulator with its measurements.
    pub fn simulator(&self) -> &dyn Simulator {
        &*self.source
    }

    /// The simulator as a [`Diagnosable`].
    pub(crate) fn source(&self) -> &dyn Diagnosable {
        &*self.source
    }
}

/// Returns the name of data: the name of the folder or file without its extension.
pub fn name_of(path: &Path) -> String {
    if path.as_os_str() == "-" {
        return "standard input".to_owned();
    }
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    real.file_stem().unwrap_or(real.as_os_str()).to_string_lossy().into_owned()
}
