//! The lake as tables of a session.

use std::{collections::BTreeSet, path::Path, sync::Arc};

use anyhow::{Context, ensure};
use datafusion::{
    arrow::datatypes::{DataType, SchemaRef},
    datasource::{
        file_format::parquet::ParquetFormat,
        listing::{ListingOptions, ListingTable, ListingTableConfig, ListingTableUrl},
    },
    prelude::{Expr, SessionContext, cast, col, ident, lit, not},
};

use super::{Lake, place::COLUMNS};

/// Registers the lake's trials as the table `trials`, with site, rig, sensor and date from its
/// folders; unfit files are left out.
///
/// # Errors
/// An unfit file in a folder whose name a query cannot distinguish from others.
pub(crate) fn register(session: &SessionContext, lake: &Lake) -> anyhow::Result<()> {
    let folder = lake.folder.join("trials");
    let urls = vec![folder_url(&folder)?];
    let whole = listing(urls, &COLUMNS, lake.schema.clone())?;
    if lake.unfit.is_empty() {
        session.register_table("trials", whole)?;
        return Ok(());
    }
    // Files in the folder of an unfit file are read one by one, all others as a folder.
    let mut spoilt = BTreeSet::new();
    for file in &lake.unfit {
        spoilt.extend(partition(file.path.strip_prefix(&folder)?)?);
    }
    let is_of = |places: &[String; 4]| {
        let equals = COLUMNS.iter().zip(places).map(|(name, value)| match *name {
            "date" => col(*name).eq(cast(lit(value.as_str()), DataType::Date32)),
            _ => col(*name).eq(lit(value.as_str())),
        });
        equals.reduce(Expr::and)
    };
    let is_spoilt = spoilt.iter().filter_map(is_of).reduce(Expr::or);
    let mut frame = session.read_table(whole)?;
    frame = match is_spoilt {
        Some(is_spoilt) => frame.filter(not(is_spoilt))?,
        None => frame,
    };
    for places in &spoilt {
        let beside = lake.files.iter().filter(|file| {
            partition(file.path.strip_prefix(&folder).unwrap_or(&file.path))
                .is_ok_and(|own| own.as_ref() == Some(places))
        });
        let urls: Vec<_> = beside
            .map(|file| ListingTableUrl::parse(file.path.display().to_string()))
            .collect::<Result<_, _>>()?;
        if urls.is_empty() {
            continue;
        }
        let files = session.read_table(listing(urls, &[], lake.schema.clone())?)?;
        let own = lake.schema.fields().iter().map(|field| ident(field.name()));
        let places = COLUMNS.iter().zip(places).map(|(name, value)| match *name {
            "date" => cast(lit(value.as_str()), DataType::Date32).alias(*name),
            _ => lit(value.as_str()).alias(*name),
        });
        frame = frame.union(files.select(own.chain(places).collect::<Vec<_>>())?)?;
    }
    session.register_table("trials", frame.into_view())?;
    Ok(())
}

/// The folder values that a query would give to a file's rows; `None` for a file that no query
/// reads.
fn partition(path: &Path) -> anyhow::Result<Option<[String; 4]>> {
    let mut folders = path.components().map(|c| c.as_os_str().to_string_lossy().into_owned());
    let mut values = [const { String::new() }; 4];
    for (value, column) in values.iter_mut().zip(COLUMNS) {
        let folder = folders.next().unwrap_or_default();
        match folder.split_once('=') {
            Some((name, text)) if name == column => *value = text.to_owned(),
            _ => return Ok(None),
        }
    }
    let is_told = !values.iter().any(|value| value.contains('%'))
        && values[3].parse::<chrono::NaiveDate>().is_ok();
    ensure!(
        is_told,
        "{}: no query can leave it out, for its folders are no places; take it out of the lake",
        path.display()
    );
    Ok(Some(values))
}

/// Makes a folder of Parquet files a table; `places` are the names of its folders, `date` being a date.
pub(crate) fn register_folder(
    session: &SessionContext,
    name: &str,
    folder: &Path,
    places: &[&str],
    schema: SchemaRef,
) -> anyhow::Result<()> {
    let table = listing(vec![folder_url(folder)?], places, schema)?;
    session.register_table(name, table)?;
    Ok(())
}

fn folder_url(folder: &Path) -> anyhow::Result<ListingTableUrl> {
    let folder = folder.canonicalize().with_context(|| folder.display().to_string())?;
    Ok(ListingTableUrl::parse(format!("{}/", folder.display()))?)
}

/// Parquet files as a table; `places` are the names of their folders, `date` being a date.
fn listing(
    urls: Vec<ListingTableUrl>,
    places: &[&str],
    schema: SchemaRef,
) -> anyhow::Result<Arc<ListingTable>> {
    let kind = |name: &str| match name {
        "date" => DataType::Date32,
        _ => DataType::Utf8,
    };
    let partitions = places.iter().map(|name| ((*name).to_owned(), kind(name))).collect();
    let options = ListingOptions::new(Arc::new(ParquetFormat::default()))
        .with_file_extension(".parquet")
        .with_table_partition_cols(partitions);
    let config = ListingTableConfig::new_with_multi_paths(urls);
    let config = config.with_listing_options(options).with_schema(schema);
    Ok(Arc::new(ListingTable::try_new(config)?))
}
