//! A lake: folders of Parquet files, one per trial, and their common properties.
//!
//! ```text
//! DIR/lake.json                                                    signal, reference, rate estimator, sample rate
//! DIR/trials/site=S/rig=R/sensor=N/date=YYYY-MM-DD/<digest>.parquet  one trial, sorted by time
//! DIR/states/poly13/site=S/rig=R/<YYYY-MM>.parquet                 partial fits, a row a sensor and day
//! DIR/refused/                                                     the reason for each file that is not in the lake
//! DIR/.stretch-lock                                                locked by the command that writes
//! ```

mod about;
mod place;
#[cfg(test)]
mod tests;
mod write;

use std::{
    collections::BTreeMap,
    fs::{self, File},
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail, ensure};
use datafusion::{
    arrow::datatypes::{DataType, Field, Schema, SchemaRef},
    parquet::arrow::arrow_reader::ArrowReaderMetadata,
};
use rayon::{iter::Either, prelude::*};

pub(crate) use about::{About, Footer, digest, digest_of_file};
pub(crate) use place::{COLUMNS, Place, check_name, register, register_folder};
pub(crate) use write::{Samples, write, write_parquet};

use crate::show::caught;

/// A lake and its files.
#[derive(Debug)]
pub(crate) struct Lake {
    pub folder: PathBuf,
    pub about: About,
    /// Every trial, ordered by place.
    pub files: Vec<LakeFile>,
    /// Columns of all files. A column that a file lacks is null in its rows.
    pub schema: SchemaRef,
    /// Files below `trials` that no query can read together with the others.
    pub unfit: Vec<Unfit>,
    /// Notes for the user.
    pub notes: Vec<String>,
}

/// A file below `trials` that is left out.
#[derive(Debug)]
pub(crate) struct Unfit {
    pub path: PathBuf,
    /// The reason, and what to do.
    pub why: String,
    /// Whether the file is readable, but its signal, reference or rates differ from those in
    /// lake.json.
    pub is_of_another_lake: bool,
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
    /// Reads the footers of all files, without writing anything. A file that cannot be read, or
    /// that no query can read together with the others, is left out.
    pub(crate) fn open(folder: &Path) -> anyhow::Result<Self> {
        let shown = folder.display();
        let Some(about) = About::read(folder)? else {
            bail!(
                "{shown} is not a lake, because it has no lake.json; stretch-fleet ingest creates one"
            );
        };
        let folder = folder.canonicalize().with_context(|| shown.to_string())?;
        let paths = files(&folder.join("trials"))?;
        let read = paths.par_iter().map(|path| LakeFile::read(&folder, path, &about));
        let (unfit, mut files): (Vec<Unfit>, Vec<LakeFile>) = read.partition_map(Either::from);
        files.sort_by(|a, b| (&a.place, &a.path).cmp(&(&b.place, &b.path)));
        let (schema, notes) = common(&about, &files);
        Ok(Self { folder, about, files, schema, unfit, notes })
    }
}

impl LakeFile {
    fn read(lake: &Path, path: &Path, about: &About) -> Result<Self, Unfit> {
        let unfit = |why, is_of_another_lake| Unfit { path: path.into(), why, is_of_another_lake };
        let file = Self::parse(lake, path).map_err(|why| unfit(format!("{why:#}"), false))?;
        about.check(&file.footer.about).map_err(|why| unfit(why, true))?;
        Ok(file)
    }

    fn parse(lake: &Path, path: &Path) -> anyhow::Result<Self> {
        let place = Place::of(path.strip_prefix(lake.join("trials"))?)?;
        let damaged = "it is damaged; ingest its trial again";
        let parquet = metadata(path).context(damaged)?;
        let footer = Footer::of(&parquet)?;
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
                    "its column {name} is of type {found}, and no query could read it together with the others; ingest the trial again"
                );
            }
        }
        Ok(Self { path: path.to_owned(), place, footer, columns })
    }
}

/// Reads the footer of a Parquet file, including the embedded Arrow schema.
///
/// # Errors
/// A file that cannot be read, or on which the reader panics.
pub(crate) fn metadata(path: &Path) -> anyhow::Result<ArrowReaderMetadata> {
    let file = File::open(path)?;
    Ok(caught(|| ArrowReaderMetadata::load(&file, Default::default()))??)
}

/// Returns every Parquet file below a folder, sorted.
pub(crate) fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = below(folder, usize::MAX)?;
    found.retain(|path| path.extension().is_some_and(|ending| ending == "parquet"));
    Ok(found)
}

/// Returns every file at most `depth` folders below a folder, sorted. The result is empty if the
/// folder does not exist.
pub(crate) fn below(folder: &Path, depth: usize) -> anyhow::Result<Vec<PathBuf>> {
    let (mut found, mut folders) = (Vec::new(), vec![(folder.to_owned(), depth)]);
    while let Some((folder, depth)) = folders.pop() {
        let entries = match fs::read_dir(&folder) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => continue,
            entries => entries.with_context(|| folder.display().to_string())?,
        };
        for entry in entries {
            let entry = entry?;
            if !entry.file_type()?.is_dir() {
                found.push(entry.path());
            } else if depth > 0 {
                folders.push((entry.path(), depth - 1));
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Returns the columns of all files, with numbers as f64, and notes on files that lack some of
/// them.
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

/// A file that was refused.
#[derive(Debug, Clone)]
pub(crate) struct Refused {
    /// The file.
    pub file: String,
    /// The reason, and what to do.
    pub why: String,
}

/// Writes the error of a refused file into `refused/`, one text file each, so that a user finds
/// there which files are missing and why.
pub(crate) fn refuse(lake: &Path, file: &Path, why: &str) -> anyhow::Result<Refused> {
    let refused = Refused { file: file.display().to_string(), why: why.to_owned() };
    let folder = lake.join("refused");
    fs::create_dir_all(&folder)?;
    let text = format!("{}: {why}\n", refused.file);
    stretch_data::files::write_whole(folder.join(note(file)), |out| {
        out.write_all(text.as_bytes())
    })?;
    Ok(refused)
}

/// Removes the stored error of a file that is now in the lake.
pub(crate) fn accept(lake: &Path, file: &Path) -> std::io::Result<()> {
    match fs::remove_file(lake.join("refused").join(note(file))) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// Moves the files that no query can read into `refused/`, under names that contain their former
/// path.
///
/// # Errors
/// More files that contradict lake.json than files that agree with it. In that case lake.json
/// itself is wrong, and all files are left where they are.
pub(crate) fn set_aside(lake: &Lake) -> anyhow::Result<Vec<Refused>> {
    let others: Vec<&Unfit> = lake.unfit.iter().filter(|file| file.is_of_another_lake).collect();
    if let Some(Unfit { path, why, .. }) = others.first() {
        ensure!(
            others.len() <= lake.files.len(),
            "lake.json fits {} of the lake's files but not {} others, the first of them {}: {why}. Nothing was moved: correct \
             lake.json, or remove those files",
            lake.files.len(),
            others.len(),
            path.display()
        );
    }
    let one = |Unfit { path, why, .. }: &Unfit| {
        let stood = path.strip_prefix(lake.folder.join("trials")).unwrap_or(path);
        let name = stood.display().to_string().replace('/', ",");
        let refused = refuse(&lake.folder, path, why)?;
        let folder = lake.folder.join("refused");
        let mut free = folder.join(&name);
        let mut number = 1;
        while free.exists() {
            number += 1;
            free = folder.join(format!("{name}.{number}"));
        }
        fs::rename(path, free)?;
        Ok(refused)
    };
    lake.unfit.iter().map(one).collect()
}

/// Returns a name for the stored error of a file, which depends only on its path.
fn note(file: &Path) -> String {
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
    let path = file.display().to_string();
    format!("{name}-{}.txt", &digest([path.as_bytes()])[..8])
}
