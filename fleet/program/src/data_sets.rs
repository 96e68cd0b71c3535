//! The trials of a lake in recorded form, grouped by sensor and time.

use std::{
    collections::BTreeMap,
    fs::File,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, ensure};
use datafusion::{
    arrow::{
        array::{Array, AsArray, RecordBatch},
        compute::{cast, concat_batches},
        datatypes::{DataType, Float64Type, Schema},
    },
    parquet::{arrow::arrow_reader::ParquetRecordBatchReaderBuilder, errors::ParquetError},
};
use stretch_data::{
    Channel, SessionTrial, Trial,
    files::{guard_inputs, is_input},
};

use crate::{
    lake::{Lake, LakeFile, Refused},
    show::{caught, warn_of},
};

const DAY_S: f64 = 86400.0;

/// Which trials of a sensor belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum By {
    /// A sensor's trials of a day
    Day,
    /// A sensor's trials of a month
    Month,
    /// All trials of a sensor
    Sensor,
}

/// Site, rig, sensor, and the day or month (or `all`).
pub(crate) type Name = [String; 4];

/// Opens a lake that contains trials. Files that cannot be used are reported.
pub(crate) fn lake_with_trials(folder: &Path) -> anyhow::Result<Lake> {
    // No output may overwrite a file of the lake.
    guard_inputs([])?;
    let lake = Lake::open(folder)?;
    lake.files.iter().try_for_each(|file| is_input(&file.path))?;
    let left_out = lake
        .unfit
        .iter()
        .map(|file| Refused { file: file.path.display().to_string(), why: file.why.clone() });
    warn_of("left out:", &left_out.collect::<Vec<_>>());
    ensure!(!lake.files.is_empty(), "{}: the lake contains no trial", folder.display());
    Ok(lake)
}

/// Groups the files of a lake into data sets.
pub(crate) fn data_sets(lake: &Lake, by: By) -> BTreeMap<Name, Vec<&LakeFile>> {
    let mut sets: BTreeMap<Name, Vec<&LakeFile>> = BTreeMap::new();
    for file in &lake.files {
        let when = match by {
            By::Day => file.place.date.to_string(),
            By::Month => file.place.month(),
            By::Sensor => "all".to_owned(),
        };
        let [site, rig, sensor] = file.place.gauge().map(str::to_owned);
        sets.entry([site, rig, sensor, when]).or_default().push(file);
    }
    sets
}

/// Returns the trials of a data set in order of time. Times count from its first day.
pub(crate) fn trials(files: &[&LakeFile]) -> anyhow::Result<Vec<SessionTrial>> {
    let first = files.iter().map(|file| file.place.date).min();
    let mut trials = Vec::new();
    for file in files {
        let mut trial = trial(file)?;
        let days = first.map_or(0, |first| (file.place.date - first).num_days());
        trial.start_s += DAY_S * days as f64;
        trials.push(trial);
    }
    trials.sort_by(|a, b| {
        a.start_s.total_cmp(&b.start_s).then_with(|| a.trial.name.cmp(&b.trial.name))
    });
    Ok(trials)
}

/// Reads a trial as it was recorded: bridged samples are removed again.
fn trial(file: &LakeFile) -> anyhow::Result<SessionTrial> {
    let shown = || file.path.display().to_string();
    let batch = read(std::slice::from_ref(&file.path))?;
    let bridged = batch.column_by_name("is_bridged").and_then(|array| array.as_boolean_opt());
    let kept: Vec<usize> = (0..batch.num_rows())
        .filter(|&row| !bridged.is_some_and(|bridged| bridged.is_valid(row) && bridged.value(row)))
        .collect();
    let values = |name: &str| -> anyhow::Result<Vec<f64>> {
        let array =
            batch.column_by_name(name).with_context(|| format!("{}: no column {name}", shown()))?;
        let array = cast(array, &DataType::Float64)?;
        let array = array.as_primitive::<Float64Type>();
        Ok(kept
            .iter()
            .map(|&row| if array.is_null(row) { f64::NAN } else { array.value(row) })
            .collect())
    };
    let own = ["trial", "time_s", "rate", "contraction", "is_bridged"];
    let schema = batch.schema();
    let names = schema.fields().iter().map(|field| field.name().as_str());
    let channels = names
        .filter(|name| !own.contains(name) || *name == file.footer.about.reference)
        .map(|name| Ok(Channel { name: name.to_owned(), values: values(name)? }))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let footer = &file.footer;
    let trial = Trial { name: footer.trial.clone(), time_s: values("time_s")?, channels };
    Ok(SessionTrial {
        kind: footer.kind,
        start_s: footer.start_s,
        split: footer.split,
        notes: footer.notes.clone(),
        ..SessionTrial::new(trial)
    })
}

/// Reads all rows of some files with the same layout.
pub(crate) fn read(paths: &[PathBuf]) -> anyhow::Result<RecordBatch> {
    let mut batches = Vec::new();
    for path in paths {
        let told = || path.display().to_string();
        let file = File::open(path).with_context(told)?;
        let rows = caught(|| {
            let rows = ParquetRecordBatchReaderBuilder::try_new(file)?.build()?;
            Ok::<_, ParquetError>(rows.collect::<Result<Vec<_>, _>>()?)
        });
        batches.extend(rows.with_context(told)?.with_context(told)?);
    }
    let schema = batches.first().map_or_else(|| Arc::new(Schema::empty()), RecordBatch::schema);
    Ok(concat_batches(&schema, &batches)?)
}
