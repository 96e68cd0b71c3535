//! The place of a trial: site, rig, sensor and date; and the registration of Parquet files as
//! tables, whose folders provide these columns.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail, ensure};
use chrono::NaiveDate;
use datafusion::{
    arrow::datatypes::{DataType, SchemaRef},
    datasource::{
        file_format::parquet::ParquetFormat,
        listing::{ListingOptions, ListingTable, ListingTableConfig, ListingTableUrl},
    },
    prelude::{Expr, SessionContext, cast, col, ident, lit, not},
};

use super::Lake;

/// Columns of the place, in the order of the folders.
pub(crate) const COLUMNS: [&str; 4] = ["site", "rig", "sensor", "date"];

/// Longest name of a site, rig or sensor. With the name of its column, or with the extension of a
/// calibration file, it is still a valid file name on every system.
const MOST_LETTERS: usize = 100;

/// Refuses a name that cannot be a folder, or that would lead out of one.
pub(crate) fn check_name(what: &str, name: &str) -> anyhow::Result<()> {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    ensure!(
        !name.is_empty()
            && name.len() <= MOST_LETTERS
            && name.chars().all(is_plain)
            && !name.starts_with('.'),
        "{name:?} cannot be a {what}: use letters, digits, -, _ and ., at most {MOST_LETTERS} of them"
    );
    Ok(())
}

/// Returns the values of the folders `site=..`, `rig=..`, `sensor=..` and `date=..` at the
/// beginning of a path.
fn folder_values(path: &Path) -> Option<[String; 4]> {
    let mut parts = path.components().map(|c| c.as_os_str().to_string_lossy());
    let mut values = [const { String::new() }; 4];
    for (value, column) in values.iter_mut().zip(COLUMNS) {
        *value = parts.next()?.strip_prefix(column)?.strip_prefix('=')?.to_owned();
    }
    Some(values)
}

/// The partition of a trial.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Place {
    pub site: String,
    pub rig: String,
    pub sensor: String,
    pub date: NaiveDate,
}

impl Place {
    /// Checks the names, which become folders, and parses a date such as 2026-11-21 or 20261121.
    pub(crate) fn new([site, rig, sensor, date]: [&str; 4]) -> anyhow::Result<Self> {
        for (what, name) in COLUMNS.iter().zip([site, rig, sensor]) {
            check_name(what, name)?;
        }
        let forms = ["%Y-%m-%d", "%Y%m%d"];
        let read = forms.iter().find_map(|form| NaiveDate::parse_from_str(date, form).ok());
        let Some(date) = read else {
            bail!("{date:?} is not a date: write 2026-11-21 or 20261121");
        };
        let [site, rig, sensor] = [site, rig, sensor].map(str::to_owned);
        Ok(Self { site, rig, sensor, date })
    }

    /// Returns the folder of the place below `trials`.
    pub(crate) fn folder(&self) -> PathBuf {
        let Self { site, rig, sensor, date } = self;
        PathBuf::from(format!("site={site}/rig={rig}/sensor={sensor}/date={date}"))
    }

    /// Parses the place of a path below `trials`.
    pub(crate) fn of(path: &Path) -> anyhow::Result<Self> {
        let named = folder_values(path).filter(|_| path.components().count() == COLUMNS.len() + 1);
        let named = named.context("it is not in a folder site=../rig=../sensor=../date=..")?;
        Self::new(named.each_ref().map(String::as_str))
    }

    /// Returns site, rig and sensor, without the date.
    pub(crate) fn gauge(&self) -> [&str; 3] {
        [&self.site, &self.rig, &self.sensor]
    }

    pub(crate) fn month(&self) -> String {
        self.date.format("%Y-%m").to_string()
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}/{} of {}", self.site, self.rig, self.sensor, self.date)
    }
}

/// Registers the lake's trials as the table `trials`, with site, rig, sensor and date from its
/// folders. Unfit files, which no query can read together with the others, are left out.
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
    // Files in the same folder as an unfit file are listed one by one, all others as a folder.
    let mut spoilt = BTreeSet::new();
    for file in &lake.unfit {
        spoilt.extend(partition(file.path.strip_prefix(&folder)?)?);
    }
    let is_of = |places: &[String; 4]| {
        let values = COLUMNS.iter().zip(places);
        values.map(|(name, text)| col(*name).eq(value(name, text))).reduce(Expr::and)
    };
    let mut frame = session.read_table(whole)?;
    if let Some(is_spoilt) = spoilt.iter().filter_map(is_of).reduce(Expr::or) {
        frame = frame.filter(not(is_spoilt))?;
    }
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
        let places = COLUMNS.iter().zip(places).map(|(name, text)| value(name, text).alias(*name));
        frame = frame.union(files.select(own.chain(places).collect::<Vec<_>>())?)?;
    }
    session.register_table("trials", frame.into_view())?;
    Ok(())
}

/// Returns the value of a folder as a literal with the type of its column.
fn value(column: &str, text: &str) -> Expr {
    if column == "date" { cast(lit(text), DataType::Date32) } else { lit(text) }
}

/// Returns the folder values that a query would assign to a file's rows, or `None` for a file that
/// no query reads.
fn partition(path: &Path) -> anyhow::Result<Option<[String; 4]>> {
    let values = folder_values(path);
    let is_place = |values: &[String; 4]| {
        !values.iter().any(|value| value.contains('%')) && values[3].parse::<NaiveDate>().is_ok()
    };
    ensure!(
        values.as_ref().is_none_or(is_place),
        "{}: no query can leave this file out, because its folders are not valid places; move it out of the lake",
        path.display()
    );
    Ok(values)
}

/// Registers a folder of Parquet files as a table. `places` are the names of its folder levels;
/// `date` has the type date.
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

/// Returns Parquet files as a table. `places` are the names of their folder levels; `date` has the
/// type date.
fn listing(
    urls: Vec<ListingTableUrl>,
    places: &[&str],
    schema: SchemaRef,
) -> anyhow::Result<Arc<ListingTable>> {
    let kind = |name: &str| if name == "date" { DataType::Date32 } else { DataType::Utf8 };
    let partitions = places.iter().map(|name| ((*name).to_owned(), kind(name))).collect();
    let options = ListingOptions::new(Arc::new(ParquetFormat::default()))
        .with_file_extension(".parquet")
        .with_table_partition_cols(partitions);
    let config = ListingTableConfig::new_with_multi_paths(urls);
    let config = config.with_listing_options(options).with_schema(schema);
    Ok(Arc::new(ListingTable::try_new(config)?))
}
