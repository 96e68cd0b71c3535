//! Reads a gauge alone from files: its trials, and which columns are reference and signal.

use std::path::Path;

use stretch_data::{DataSet, RigFile, SessionTrial, Trial};
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::{Catalogue, GaugeRig};

use super::{GaugeSetup, GaugeSimulator};
use crate::{bench::read_rig, error::ProblemError};

/// Reference and signal if no columns are named.
const USUAL: (&str, &str) = ("length_mm", "bridge_v");

impl GaugeSimulator {
    /// Reads a gauge alone: a trial, or the folder of a data set. `columns` are reference and signal; without them
    /// `length_mm` and `bridge_v` are taken. `None` if the path holds a whole rig: neither columns nor a rig file
    /// identify a gauge alone, and the trials have valve openings (a column `inlet` or `outlet`).
    ///
    /// A gauge alone is recognised by its columns, by a rig file of `kind = "gauge"` (given, or
    /// named by the data set), or by trials without openings.
    ///
    /// # Errors
    /// Files that cannot be read, columns that have to be named, and as [`GaugeSimulator::new`].
    pub fn read(
        path: &Path,
        columns: Option<(&str, &str)>,
        rig: Option<&Path>,
        catalogue: &Catalogue,
        recorded: &ReadOptions,
    ) -> Result<Option<Self>, ProblemError> {
        let set = if path.is_dir() { Some(DataSet::read(path)?) } else { None };
        let own = set.as_ref().and_then(|set| Some(path.join(set.rig.as_ref()?)));
        let is_gauge =
            |path: &Path| RigFile::read(path).map(|file| file.kind.as_deref() == Some("gauge"));
        let (rig, says_so) = match (rig, &own) {
            (Some(rig), _) => (Some(rig), is_gauge(rig)?),
            (None, Some(own)) if is_gauge(own)? => (Some(own.as_path()), true),
            _ => (None, false),
        };
        let mut options = recorded.clone();
        if let Some((reference, signal)) = columns {
            options = options.require(reference).require(signal);
        }
        let first = match &set {
            Some(set) => Recording::of_entry(&set.trials[0], path, &options)?,
            None => Recording::read(path, &options)?,
        };
        let Some((reference, signal)) = columns_of(&first.trial, columns, says_so)? else {
            return Ok(None);
        };
        let (reference, signal) = (reference.to_owned(), signal.to_owned());
        let (reference, signal) = (reference.as_str(), signal.as_str());
        let trials = match &set {
            // The recording is read once, because it may be standard input.
            None => vec![SessionTrial::from(first)],
            Some(set) => {
                let options = recorded.clone().require(reference).require(signal);
                Recording::session(set, path, &options)?
            }
        };
        let rig = rig.map(|path| read_rig(path, GaugeRig::from_file)).transpose()?;
        let rig = rig.as_ref();
        Self::new(&GaugeSetup { trials: &trials, reference, signal, rig, catalogue }).map(Some)
    }
}

/// Reference and signal; `None` if the trial is of a whole rig.
fn columns_of<'a>(
    first: &'a Trial,
    named: Option<(&'a str, &'a str)>,
    says_so: bool,
) -> Result<Option<(&'a str, &'a str)>, ProblemError> {
    let has = |name: &str| first.channel(name).is_some();
    match named {
        Some((reference, signal)) => {
            Ok(Some((first.full_name(reference), first.full_name(signal))))
        }
        None if !says_so && (has("inlet") || has("outlet")) => Ok(None),
        None if has(USUAL.0) && has(USUAL.1) => Ok(Some(USUAL)),
        None => {
            let names: Vec<&str> = first.channels.iter().map(|c| c.name.as_str()).collect();
            let (own, names) = (&first.name, names.join(", "));
            Err(ProblemError::too_little(
                format!("{own} is a gauge alone, but its reference and its signal are not known"),
                format!(
                    "name their columns with stretch diagnose --reference and --signal; the columns are {names}"
                ),
            ))
        }
    }
}
