//! Results of a query: as flat columns, as a table, as CSV, and as calibration files for
//! `stretch apply`.

use std::{collections::HashSet, path::Path, sync::Arc};

use anyhow::{Context, ensure};
use datafusion::arrow::{
    array::{Array, ArrayRef, AsArray, RecordBatch},
    compute::concat_batches,
    datatypes::{DataType, Field, Schema},
    util::{
        display::{ArrayFormatter, FormatOptions},
        pretty::pretty_format_batches,
    },
};
use stretch_calibrate::{calibration_from_json, calibration_to_json};
use stretch_core::{Calibration, Label, Provenance, Target};

use crate::lake::{Lake, LakeFile, Refused, check_name};

/// Columns that are too long for a table.
const LONG: [&str; 2] = ["record", "state"];

/// Merges all batches into one without structs. A field keeps its name if the name is unique,
/// otherwise its struct's name precedes it.
pub(crate) fn flat(batches: &[RecordBatch]) -> anyhow::Result<RecordBatch> {
    let first = batches.first().context("the query has no result")?;
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

/// Returns the column with this name, or whose name after the last dot is this.
fn column<'a>(batch: &'a RecordBatch, name: &str) -> Option<&'a ArrayRef> {
    let schema = batch.schema();
    let is_it = |own: &str| own == name || own.rsplit('.').next() == Some(name);
    let place = schema.fields().iter().position(|field| is_it(field.name()))?;
    Some(batch.column(place))
}

/// Formats the result as a table. Columns that are too long are left out, unless there are no
/// others.
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

/// Formats the result as CSV, with a header line.
pub(crate) fn csv(batch: &RecordBatch) -> anyhow::Result<String> {
    let columns = batch.columns().iter().map(texts).collect::<anyhow::Result<Vec<_>>>()?;
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(batch.schema().fields().iter().map(|field| field.name()))?;
    for row in 0..batch.num_rows() {
        out.write_record(columns.iter().map(|column| &column[row]))?;
    }
    Ok(String::from_utf8(out.into_inner()?)?)
}

/// Formats the values of a column; nulls are empty.
fn texts(array: &ArrayRef) -> anyhow::Result<Vec<String>> {
    let options = FormatOptions::default();
    let format = ArrayFormatter::try_new(array.as_ref(), &options)?;
    (0..array.len()).map(|row| Ok(format.value(row).try_to_string()?)).collect()
}

/// Writes one calibration file per row, in folders of site and rig if the result has these columns.
/// Refused rows are returned with the reason.
pub(crate) fn write_records(
    lake: &Lake,
    answer: &RecordBatch,
    folder: &Path,
) -> anyhow::Result<(usize, Vec<Refused>)> {
    let records = column(answer, "record").context(
        "the result has no column record: select a fit, such as poly13_fit(rate, bridge_v, contraction)",
    )?;
    let records = texts(records)?;
    let reasons = column(answer, "refused").map(texts).transpose()?;
    let keys = ["site", "rig", "sensor", "date"];
    let named = |key| Some(texts(column(answer, key)?).map(|own| (key, own)));
    let keys: Vec<_> = keys.into_iter().filter_map(named).collect::<anyhow::Result<_>>()?;
    ensure!(
        !keys.is_empty() || records.len() == 1,
        "the {} calibrations have no names: select site, rig or sensor in addition to the fit",
        records.len()
    );
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let (mut written, mut refused, mut taken) = (0, Vec::new(), HashSet::new());
    for (row, record) in records.iter().enumerate() {
        let of: Vec<(&str, &str)> =
            keys.iter().map(|(key, own)| (*key, own[row].as_str())).collect();
        let names: Vec<&str> = of.iter().map(|(_, name)| *name).collect();
        let name = if names.is_empty() { "record".to_owned() } else { names.join("/") };
        // A query may return anything as a sensor name, so the name is checked and must be unique.
        let place = of.iter().try_for_each(|(key, name)| check_name(key, name));
        let place = place.and_then(|()| match taken.insert(name.clone()) {
            true => Ok(()),
            false => Err(anyhow::anyhow!("another row of the result has the same name")),
        });
        let reason = reasons.as_ref().map_or("", |reasons| &reasons[row]);
        let made = match (record.is_empty(), reason) {
            (false, _) => place.and_then(|()| completed(lake, record, &of)),
            (true, "") => Err(anyhow::anyhow!(
                "its fit has no calibration: fit the columns of the lake, with its rate and signal"
            )),
            (true, reason) => Err(anyhow::anyhow!("{reason}")),
        };
        match made {
            Ok(text) => {
                let path = folder.join(format!("{name}.json"));
                std::fs::create_dir_all(path.parent().unwrap_or(folder))?;
                stretch_data::files::write_whole(path, |out| out.write_all(text.as_bytes()))?;
                written += 1;
            }
            Err(why) => refused.push(Refused { file: name, why: format!("{why:#}") }),
        }
    }
    Ok((written, refused))
}

/// Completes a fit's calibration with data of the lake: the rest length of a contraction, the dead
/// band, and the trials.
///
/// Sums do not determine a dead band. It is set to the median over the trials of three standard
/// deviations of their rate noise, which is the definition in `stretch calibrate`.
fn completed(lake: &Lake, record: &str, of: &[(&str, &str)]) -> anyhow::Result<String> {
    let is_of = |file: &&LakeFile| {
        of.iter().all(|(key, value)| match *key {
            "site" => file.place.site == *value,
            "rig" => file.place.rig == *value,
            "sensor" => file.place.sensor == *value,
            _ => file.place.date.to_string() == *value,
        })
    };
    let files: Vec<&LakeFile> = lake.files.iter().filter(is_of).collect();
    let mut spec = calibration_from_json(record, "record")?.into_spec();
    if lake.about.is_contraction && spec.reference.as_str() == lake.about.target() {
        let mut rests = files.iter().filter_map(|file| file.footer.rest_length);
        let rest_length = rests.next().context("no trial has a rest length")?;
        if let Some(other) = rests.find(|other| *other != rest_length) {
            anyhow::bail!(
                "its trials have the rest lengths {rest_length} and {other}, so that their contractions have different \
                 scales: fit {} instead, or fit each sensor separately",
                lake.about.reference
            );
        }
        spec.target = Target::Contraction { rest_length };
        spec.reference = Label::new(&lake.about.reference)?;
    }
    let mut bands: Vec<f64> = files.iter().map(|file| file.footer.dead_band).collect();
    bands.sort_by(f64::total_cmp);
    spec.dead_band = bands.get(bands.len() / 2).copied().unwrap_or(0.0);
    let trials = files.iter().map(|file| file.footer.trial.as_str());
    let last = files.iter().map(|file| file.place.date).max();
    let date = last.map_or(String::new(), |date| date.to_string());
    spec.provenance = Provenance::new(&date, trials);
    Ok(calibration_to_json(&Calibration::new(spec)?)?)
}
