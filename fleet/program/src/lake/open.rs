//! A lake as it is found: the footers of its files, and what all of them have.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail};
use datafusion::{
    arrow::datatypes::{DataType, Field, Schema, SchemaRef},
    parquet::arrow::arrow_reader::ArrowReaderMetadata,
};
use rayon::prelude::*;

use super::{About, Footer, Place, Refused, refuse};

/// A lake and its files.
#[derive(Debug)]
pub(crate) struct Lake {
    pub folder: PathBuf,
    pub about: About,
    /// Every trial, in the order of places.
    pub files: Vec<LakeFile>,
    /// Columns of all files; what a file lacks is null there.
    pub schema: SchemaRef,
    /// Files that were set aside just now.
    pub refused: Vec<Refused>,
    /// What was noticed.
    pub notes: Vec<String>,
}

/// A trial of a lake.
#[derive(Debug)]
pub(crate) struct LakeFile {
    pub path: PathBuf,
    pub place: Place,
    pub footer: Footer,
    columns: SchemaRef,
}

impl Lake {
    /// Reads every footer. A file that cannot be read, or that no query could read beside the others, is moved into
    /// `refused/` with a sentence.
    pub(crate) fn open(folder: &Path) -> anyhow::Result<Self> {
        let shown = folder.display();
        let Some(about) = About::read(folder)? else {
            bail!("{shown} is no lake: it has no lake.json; stretch fleet ingest makes one");
        };
        let folder = folder.canonicalize().with_context(|| shown.to_string())?;
        let paths = files(&folder.join("trials"))?;
        let read: Vec<_> =
            paths.par_iter().map(|path| LakeFile::read(&folder, path, &about)).collect();
        let (mut files, mut refused) = (Vec::new(), Vec::new());
        for (path, read) in paths.iter().zip(read) {
            match read {
                Ok(file) => files.push(file),
                Err(why) => refused.push(set_aside(&folder, path, &format!("{why:#}"))?),
            }
        }
        files.sort_by(|a, b| (&a.place, &a.path).cmp(&(&b.place, &b.path)));
        let (schema, notes) = common(&about, &files);
        Ok(Self { folder, about, files, schema, refused, notes })
    }
}

impl LakeFile {
    fn read(lake: &Path, path: &Path, about: &About) -> anyhow::Result<Self> {
        let place = Place::of(path.strip_prefix(lake.join("trials"))?)?;
        let damaged = "it is damaged; ingest its trial again";
        let parquet = ArrowReaderMetadata::load(&File::open(path)?, Default::default())
            .map_err(|e| anyhow::anyhow!("{damaged}: {e}"))?;
        let footer = Footer::of(&parquet)?;
        about.check(&footer.about).map_err(anyhow::Error::msg)?;
        let columns = parquet.schema().clone();
        for field in columns.fields() {
            let fits = match field.name().as_str() {
                "trial" => matches!(
                    field.data_type(),
                    DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View
                ),
                "is_bridged" => field.data_type() == &DataType::Boolean,
                _ => field.data_type().is_numeric(),
            };
            if !fits {
                let (name, found) = (field.name(), field.data_type());
                bail!(
                    "its column {name} is of type {found}, and no query could read it beside the others; ingest the trial again"
                );
            }
        }
        Ok(Self { path: path.to_owned(), place, footer, columns })
    }
}

/// Every Parquet file below a folder, in order.
pub(crate) fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let (mut found, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        let entries = match fs::read_dir(&folder) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
            entries => entries.with_context(|| folder.display().to_string())?,
        };
        for entry in entries {
            let entry = entry?;
            let path = entry.path();
            if entry.file_type()?.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "parquet") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Moves a file of the lake into `refused/`, under a name that says where it stood.
fn set_aside(lake: &Path, path: &Path, why: &str) -> anyhow::Result<Refused> {
    let stood = path.strip_prefix(lake.join("trials")).unwrap_or(path);
    let name = stood.display().to_string().replace('/', ",");
    let refused = refuse(lake, path, why)?;
    fs::rename(path, lake.join("refused").join(name))?;
    Ok(refused)
}

/// The columns of all files, numbers as f64, and which files lack some.
fn common(about: &About, files: &[LakeFile]) -> (SchemaRef, Vec<String>) {
    let mut lacking: BTreeMap<&str, Vec<&LakeFile>> = BTreeMap::new();
    let mut fields: Vec<Field> = Vec::new();
    let usual = ["trial", "time_s", &about.signal, &about.reference, "rate"];
    let more = [about.target(), "is_bridged"];
    let named = files.iter().flat_map(|file| file.columns.fields()).map(|f| f.name().as_str());
    for name in usual.into_iter().chain(named).chain(more) {
        if fields.iter().all(|field| field.name() != name) {
            let kind = match name {
                "trial" => DataType::Utf8,
                "is_bridged" => DataType::Boolean,
                _ => DataType::Float64,
            };
            fields.push(Field::new(name, kind, true));
        }
    }
    let rates = [
        (stretch_fleet::SAMPLE_RATE_KEY.to_owned(), about.sample_rate_hz.to_string()),
        (
            stretch_fleet::RATE_ESTIMATOR_KEY.to_owned(),
            serde_json::to_string(&about.rate).unwrap_or_default(),
        ),
    ];
    for field in &mut fields {
        if field.data_type().is_numeric() {
            field.set_metadata(rates.clone().into());
        }
    }
    for file in files {
        for field in &fields {
            if file.columns.index_of(field.name()).is_err() {
                lacking.entry(field.name()).or_default().push(file);
            }
        }
    }
    let told = lacking.iter().map(|(column, without)| {
        let first = &without[0];
        format!(
            "{} of {} files have no column {column}, the first is {} ({}): it is null in their rows",
            without.len(),
            files.len(),
            first.footer.trial,
            first.place
        )
    });
    let told = told.collect();
    (Arc::new(Schema::new(fields)), told)
}
