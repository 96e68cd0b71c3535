//! Writing of a trial as a Parquet file, completely or not at all.

use std::{path::Path, sync::Arc};

use datafusion::{
    arrow::array::{ArrayRef, BooleanArray, Float64Array, RecordBatch, StringArray},
    parquet::{
        arrow::ArrowWriter,
        basic::Compression,
        file::{
            metadata::{KeyValue, SortingColumn},
            properties::WriterProperties,
        },
        schema::types::ColumnPath,
    },
};

use super::{Footer, about::KEY};

/// Largest row group, which is the unit that one core reads.
const GROUP_ROWS: usize = 1 << 20;

/// The rows of a trial.
#[derive(Debug, Default)]
pub(crate) struct Samples {
    pub time_s: Vec<f64>,
    /// The trial's channels, with their names.
    pub channels: Vec<(String, Vec<f64>)>,
    /// Rate of the signal; `None` while the estimator warms up.
    pub rate: Vec<Option<f64>>,
    /// Contraction, if the reference is a length.
    pub contraction: Option<Vec<f64>>,
    /// Whether the sample was lost and is bridged.
    pub is_bridged: Vec<bool>,
}

impl Samples {
    fn batch(self, trial: &str) -> anyhow::Result<RecordBatch> {
        let numbers = |values| Arc::new(Float64Array::from(values)) as ArrayRef;
        let names = StringArray::from_iter_values((0..self.time_s.len()).map(|_| trial));
        let mut columns = vec![
            ("trial".to_owned(), Arc::new(names) as ArrayRef, false),
            ("time_s".to_owned(), numbers(self.time_s), true),
        ];
        columns
            .extend(self.channels.into_iter().map(|(name, values)| (name, numbers(values), true)));
        columns.push(("rate".to_owned(), Arc::new(Float64Array::from(self.rate)), true));
        columns.extend(self.contraction.map(|x| ("contraction".to_owned(), numbers(x), true)));
        let bridged = Arc::new(BooleanArray::from(self.is_bridged));
        columns.push(("is_bridged".to_owned(), bridged, false));
        Ok(RecordBatch::try_from_iter_with_nullable(columns)?)
    }
}

/// Writes a trial, completely or not at all. The folder is created if necessary.
pub(crate) fn write(path: &Path, footer: &Footer, samples: Samples) -> anyhow::Result<()> {
    let about = KeyValue::new(KEY.to_owned(), serde_json::to_string(footer)?);
    let batch = samples.batch(&footer.trial)?;
    write_parquet(path, &batch, vec![about], Some("time_s"))
}

/// Writes a table, completely or not at all. The folder is created if necessary.
///
/// Measured numbers neither repeat nor compress, so they are stored plain, which is the fastest to
/// read.
pub(crate) fn write_parquet(
    path: &Path,
    batch: &RecordBatch,
    about: Vec<KeyValue>,
    sorted_by: Option<&str>,
) -> anyhow::Result<()> {
    let schema = batch.schema();
    let place = sorted_by.and_then(|name| schema.index_of(name).ok());
    let sorting = place.and_then(|i| i32::try_from(i).ok()).map(|column_idx| {
        vec![SortingColumn { column_idx, descending: false, nulls_first: false }]
    });
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::UNCOMPRESSED)
        .set_max_row_group_row_count(Some(GROUP_ROWS))
        .set_key_value_metadata(Some(about))
        .set_sorting_columns(sorting);
    for field in schema.fields().iter().filter(|field| field.data_type().is_floating()) {
        let column = ColumnPath::from(field.name().as_str());
        properties = properties.set_column_dictionary_enabled(column, false);
    }
    let mut bytes = Vec::new();
    let mut writer = ArrowWriter::try_new(&mut bytes, schema.clone(), Some(properties.build()))?;
    writer.write(batch)?;
    writer.close()?;
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    Ok(stretch_data::files::write_whole(path, |out| out.write_all(&bytes))?)
}
