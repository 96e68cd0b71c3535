//! The lake as tables of a session.

use std::{path::Path, sync::Arc};

use anyhow::Context;
use datafusion::{
    arrow::datatypes::{DataType, SchemaRef},
    datasource::{
        file_format::parquet::ParquetFormat,
        listing::{ListingOptions, ListingTable, ListingTableConfig, ListingTableUrl},
    },
    prelude::SessionContext,
};

use super::{Lake, place::COLUMNS};

/// Makes the lake's trials the table `trials`, with site, rig, sensor and date from its folders.
pub(crate) fn register(session: &SessionContext, lake: &Lake) -> anyhow::Result<()> {
    let folder = lake.folder.join("trials");
    register_folder(session, "trials", &folder, &COLUMNS, lake.schema.clone())
}

/// Makes a folder of Parquet files a table; `places` are the names of its folders, `date` being a date.
pub(crate) fn register_folder(
    session: &SessionContext,
    name: &str,
    folder: &Path,
    places: &[&str],
    schema: SchemaRef,
) -> anyhow::Result<()> {
    let folder = folder.canonicalize().with_context(|| folder.display().to_string())?;
    let kind = |name: &str| match name {
        "date" => DataType::Date32,
        _ => DataType::Utf8,
    };
    let partitions = places.iter().map(|name| ((*name).to_owned(), kind(name))).collect();
    let options = ListingOptions::new(Arc::new(ParquetFormat::default()))
        .with_file_extension(".parquet")
        .with_table_partition_cols(partitions);
    let url = ListingTableUrl::parse(format!("{}/", folder.display()))?;
    let config = ListingTableConfig::new(url).with_listing_options(options).with_schema(schema);
    session.register_table(name, Arc::new(ListingTable::try_new(config)?))?;
    Ok(())
}
