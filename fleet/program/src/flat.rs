//! Answers of a query as plain columns: a struct becomes one column per field.

use std::sync::Arc;

use anyhow::Context;
use datafusion::arrow::{
    array::{Array, ArrayRef, AsArray, RecordBatch},
    compute::concat_batches,
    datatypes::{DataType, Field, Schema},
    util::{
        display::{ArrayFormatter, FormatOptions},
        pretty::pretty_format_batches,
    },
};

/// Fields that are too long for a table.
const LONG: [&str; 2] = ["record", "state"];

/// Merges all batches into one without structs. A field keeps its name if the name is unique,
/// otherwise its struct's name precedes it.
pub(crate) fn flat(batches: &[RecordBatch]) -> anyhow::Result<RecordBatch> {
    let first = batches.first().context("the query has no answer")?;
    let whole = concat_batches(&first.schema(), batches)?;
    let schema = whole.schema();
    let is_struct = |field: &&Arc<Field>| matches!(field.data_type(), DataType::Struct(_));
    let is_only = schema.fields().iter().filter(is_struct).count() == 1;
    let (mut fields, mut arrays): (Vec<Field>, Vec<ArrayRef>) = (Vec::new(), Vec::new());
    for (field, array) in schema.fields().iter().zip(whole.columns()) {
        let Some(parts) = array.as_struct_opt() else {
            fields.push(field.as_ref().clone());
            arrays.push(array.clone());
            continue;
        };
        for (part, own) in parts.fields().iter().zip(parts.columns()) {
            let is_taken = schema.column_with_name(part.name()).is_some();
            let name = match is_only && !is_taken {
                true => part.name().clone(),
                false => format!("{}.{}", field.name(), part.name()),
            };
            fields.push(Field::new(name, part.data_type().clone(), true));
            arrays.push(own.clone());
        }
    }
    Ok(RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)?)
}

/// The column whose name, or the last part of it, is this.
pub(crate) fn column<'a>(batch: &'a RecordBatch, name: &str) -> Option<&'a ArrayRef> {
    let schema = batch.schema();
    let is_it = |own: &str| own == name || own.rsplit('.').next() == Some(name);
    let place = schema.fields().iter().position(|field| is_it(field.name()))?;
    Some(batch.column(place))
}

/// As a table; columns that are too long for one are left out if there is anything else.
pub(crate) fn table(batch: &RecordBatch) -> anyhow::Result<String> {
    let schema = batch.schema();
    let is_short = |i: &usize| {
        let name = schema.field(*i).name();
        !LONG.contains(&name.rsplit('.').next().unwrap_or(name))
            && !matches!(schema.field(*i).data_type(), DataType::Binary | DataType::LargeBinary)
    };
    let short: Vec<usize> = (0..batch.num_columns()).filter(is_short).collect();
    let shown = if short.is_empty() { batch.clone() } else { batch.project(&short)? };
    Ok(pretty_format_batches(&[shown])?.to_string())
}

/// As CSV, with a header line.
pub(crate) fn csv(batch: &RecordBatch) -> anyhow::Result<String> {
    let options = FormatOptions::default();
    let columns =
        batch.columns().iter().map(|array| ArrayFormatter::try_new(array.as_ref(), &options));
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let schema = batch.schema();
    let header = schema.fields().iter().map(|field| quoted(field.name()));
    let mut text = header.collect::<Vec<_>>().join(",") + "\n";
    for row in 0..batch.num_rows() {
        for (i, column) in columns.iter().enumerate() {
            if i > 0 {
                text.push(',');
            }
            text.push_str(&quoted(&column.value(row).try_to_string()?));
        }
        text.push('\n');
    }
    Ok(text)
}

/// A field of CSV (RFC 4180).
fn quoted(field: &str) -> String {
    match field.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field.to_owned(),
    }
}

/// The texts of a column, empty where there is none.
pub(crate) fn texts(array: &ArrayRef) -> anyhow::Result<Vec<String>> {
    let options = FormatOptions::default();
    let format = ArrayFormatter::try_new(array.as_ref(), &options)?;
    let text = |row| match array.is_null(row) {
        true => Ok(String::new()),
        false => Ok(format.value(row).try_to_string()?),
    };
    (0..array.len()).map(text).collect()
}
