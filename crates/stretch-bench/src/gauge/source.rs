//! Which columns of which trials: a gauge alone as it lies on a disk.

use std::path::Path;

use stretch_data::{DataSet, ReadOptions, RigFile, Split, Trial};
use stretch_sim::Catalogue;

use super::{GaugeSimulator, GaugeTrial};
use crate::error::BenchError;

/// Columns that need no naming.
const USUAL: (&str, &str) = ("length_mm", "bridge_v");

impl GaugeSimulator {
    /// Reads a gauge alone: a trial, or the folder of a data set. `columns` are reference and signal; without them
    /// `length_mm` and `bridge_v` are taken. None when it is no gauge alone: nothing says so, and the trials have openings.
    ///
    /// A gauge is told by its columns, by a rig file of `kind = "gauge"` (given, or named by the data set), or by trials
    /// without openings.
    ///
    /// # Errors
    /// Files that cannot be read, columns that have to be named, and as [`GaugeSimulator::new`].
    pub fn read(
        path: &Path,
        columns: Option<(&str, &str)>,
        rig: Option<&RigFile>,
        catalogue: &Catalogue,
    ) -> Result<Option<Self>, BenchError> {
        let set = if path.is_dir() { Some(DataSet::read(path)?) } else { None };
        let own = match &set {
            Some(set) => set.read_rig(path)?.filter(is_gauge),
            None => None,
        };
        let rig = rig.or(own.as_ref());
        let first = match &set {
            Some(set) => set.trials[0].load(path, &ReadOptions::new())?,
            None => Trial::read(path, &ReadOptions::new())?,
        };
        let has = |name: &str| first.channel(name).is_some();
        let (reference, signal) = match columns {
            Some(columns) => columns,
            None if !rig.is_some_and(is_gauge) && (has("inlet") || has("outlet")) => {
                return Ok(None);
            }
            None if has(USUAL.0) && has(USUAL.1) => USUAL,
            None => {
                let names: Vec<&str> = first.channels.iter().map(|c| c.name.as_str()).collect();
                return Err(BenchError::TooLittle {
                    what: format!(
                        "{} is a gauge alone, and nothing says which columns are the reference and the signal",
                        first.name
                    ),
                    hint: format!(
                        "name them with --reference and --signal; the columns are {}",
                        names.join(", ")
                    ),
                });
            }
        };
        let options = ReadOptions::new().require(reference).require(signal);
        let trials = match &set {
            None => {
                let trial = Trial::read(path, &options)?;
                vec![GaugeTrial { trial, start_s: 0.0, is_test: false }]
            }
            Some(set) => {
                let load = |entry: &stretch_data::TrialEntry| {
                    let trial = entry.load(path, &options)?;
                    let is_test = entry.split == Split::Test;
                    Ok(GaugeTrial { trial, start_s: entry.start_s, is_test })
                };
                set.trials.iter().map(load).collect::<Result<_, BenchError>>()?
            }
        };
        Self::new(&trials, reference, signal, rig, catalogue).map(Some)
    }
}

fn is_gauge(rig: &RigFile) -> bool {
    rig.kind.as_deref() == Some("gauge")
}
