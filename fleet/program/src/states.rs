//! Partial fits, one per sensor and day: computed once, stored, and merged by each query.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
};

use anyhow::Context;
use chrono::NaiveDate;
use datafusion::{
    arrow::{
        array::RecordBatch,
        compute::{cast, concat_batches},
        datatypes::{DataType, Field, Schema, SchemaRef},
    },
    parquet::file::metadata::KeyValue,
    prelude::SessionContext,
};

use crate::{
    lake::{Lake, LakeFile, digest, metadata, register_folder, write_parquet},
    show::bar,
    sql::ask_in_shares,
};

/// Metadata key of the digest of a file's sources.
const SOURCES: &str = "stretch.sources";

/// Trials of a rig in a month, whose states are stored in one file.
struct Unit<'a> {
    path: PathBuf,
    month: String,
    files: Vec<&'a LakeFile>,
}

impl Unit<'_> {
    /// Returns a digest of the trials' digests, the version of `stretch_fleet` (which provides the SQL functions) and the
    /// version of the stored states.
    fn sources(&self) -> String {
        let version = format!("poly13 {} {}", stretch_fleet::VERSION, stretch_fleet::STATE_VERSION);
        let names = self.files.iter().map(|file| file.footer.digest.as_bytes());
        digest(std::iter::once(version.as_bytes()).chain(names))
    }

    fn is_done(&self) -> bool {
        let parquet = metadata(&self.path).ok();
        let own = parquet.as_ref().and_then(|parquet| {
            let pairs = parquet.metadata().file_metadata().key_value_metadata()?;
            pairs.iter().find(|pair| pair.key == SOURCES)?.value.clone()
        });
        own == Some(self.sources())
    }

    /// Computes the states of all sensors and days in one pass, and writes the file completely or
    /// not at all.
    ///
    /// Threads of this machine share the sensors. Each takes the rows of its sensors in their
    /// order, so that sums have the same bits in every run. Machines of a cluster share the rows,
    /// and sums are added in the order in which they finish.
    async fn compute(
        &self,
        lake: &Lake,
        session: &SessionContext,
        shares: Option<usize>,
    ) -> anyhow::Result<()> {
        let Some(first) = self.files.first() else { return Ok(()) };
        let [site, rig, _] = first.place.gauge();
        let dates = self.files.iter().map(|file| file.place.date);
        let (from, to) = dates.fold((NaiveDate::MAX, NaiveDate::MIN), |(from, to), date| {
            (from.min(date), to.max(date))
        });
        let question = |of: &str| {
            format!(
                "select sensor, date, poly13_state(rate, \"{}\", \"{}\") as state from trials \
                 where site = '{site}' and rig = '{rig}' and date between date '{from}' and date '{to}'{of} \
                 group by sensor, date order by sensor, date",
                lake.about.signal,
                lake.about.target()
            )
        };
        let sensors: BTreeSet<&str> =
            self.files.iter().map(|file| file.place.sensor.as_str()).collect();
        let condition =
            |own: &[&str]| format!(" and sensor between '{}' and '{}'", own[0], own[own.len() - 1]);
        let batches = ask_in_shares(session, shares, sensors, question, condition).await?;
        let batch = plain(&batches)?;
        let sources = KeyValue::new(SOURCES.to_owned(), self.sources());
        write_parquet(&self.path, &batch, vec![sources], None)
    }
}

/// Returns the schema of stored states. The query engine may use other types for texts.
fn schema() -> SchemaRef {
    Arc::new(Schema::new(vec![
        Field::new("sensor", DataType::Utf8, true),
        Field::new("date", DataType::Date32, true),
        Field::new("state", DataType::Binary, true),
    ]))
}

fn plain(batches: &[RecordBatch]) -> anyhow::Result<RecordBatch> {
    let first = batches.first().context("the states of a month have no row")?;
    let whole = concat_batches(&first.schema(), batches)?;
    let schema = schema();
    let columns = whole.columns().iter().zip(schema.fields());
    let columns =
        columns.map(|(array, field)| cast(array, field.data_type())).collect::<Result<_, _>>()?;
    Ok(RecordBatch::try_new(schema, columns)?)
}

/// Computes missing states, and those whose trials have changed, and registers all of them as the
/// table `states`: site, rig, sensor, date, state. Returns the number of months that were computed.
///
/// A month of a rig is written completely, so the next run only computes the months that a kill
/// left out.
pub(crate) async fn bring_up(
    lake: &Lake,
    session: &SessionContext,
    shares: Option<usize>,
) -> anyhow::Result<usize> {
    let folder = lake.folder.join("states/poly13");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let mut units: BTreeMap<PathBuf, Unit<'_>> = BTreeMap::new();
    for file in &lake.files {
        let ([site, rig, _], month) = (file.place.gauge(), file.place.month());
        let path = folder.join(format!("site={site}/rig={rig}/{month}.parquet"));
        let unit = units.entry(path.clone());
        unit.or_insert(Unit { path, month, files: Vec::new() }).files.push(file);
    }
    // Removes states of trials that do not exist any more.
    for path in crate::lake::files(&folder)? {
        if !units.contains_key(&path) {
            std::fs::remove_file(&path).with_context(|| path.display().to_string())?;
        }
    }
    let open: Vec<_> = units.values().filter(|unit| !unit.is_done()).collect();
    let bar = bar("months of rigs", open.len());
    for unit in &open {
        bar.set_message(format!("month {} of a rig", unit.month));
        unit.compute(lake, session, shares).await?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    register_folder(session, "states", &folder, &["site", "rig"], schema())?;
    Ok(open.len())
}
