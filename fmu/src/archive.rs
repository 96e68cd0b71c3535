//! The FMU file: unpacked, read and checked before any of its code runs.

use std::{
    fs,
    path::{Path, PathBuf},
};

use fmi_rs::{
    fmi2, fmi3,
    model_description::{
        self, FMIMajorVersion, ModelDescriptionError, fmi2::ModelDescription as Description2,
        fmi3::ModelDescription as Description3,
    },
    zip::{ZipError, extract_zip_archive},
};
use tempfile::TempDir;

use crate::{
    error::FmuError,
    model::{Model, Version},
};

/// An FMU, unpacked into a temporary folder.
#[derive(Debug)]
pub struct Fmu {
    file: PathBuf,
    folder: TempDir,
    model: Model,
}

impl Fmu {
    /// Unpacks an FMU and reads its description; none of its code runs.
    ///
    /// # Errors
    /// Files that are no FMU for co-simulation, or that contain no library for this machine.
    ///
    /// ```
    /// let error = stretch_fmu::Fmu::open("no_such.fmu").unwrap_err();
    /// assert!(error.to_string().starts_with("no_such.fmu: "));
    /// ```
    pub fn open(file: impl AsRef<Path>) -> Result<Self, FmuError> {
        let file = file.as_ref().to_owned();
        let folder = TempDir::new().map_err(|e| FmuError::of(&file, e))?;
        extract_zip_archive(&file, folder.path()).map_err(|e| match e {
            ZipError::Io(e) => FmuError::of(&file, e),
            ZipError::Zip(e) => FmuError::of(
                &file,
                format_args!(
                    "it is not a ZIP archive, so it is not an FMU ({e}); give the .fmu file itself"
                ),
            ),
            e => FmuError::of(&file, e),
        })?;
        let model = described(&file, folder.path())?;
        let fmu = Self { file, folder, model };
        match fmu.library().is_file() {
            true => Ok(fmu),
            false => Err(fmu.no_library()),
        }
    }

    /// Returns the model description.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Returns the path from which the FMU was opened.
    pub fn file(&self) -> &Path {
        &self.file
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn library(&self) -> PathBuf {
        let name = format!("{}{}", self.model.identifier, fmi_rs::SHARED_LIBRARY_EXTENSION);
        self.folder().join("binaries").join(self.platform()).join(name)
    }

    fn platform(&self) -> &'static str {
        match self.model.version {
            Version::Fmi2 => fmi2::PLATFORM,
            Version::Fmi3 => fmi3::native::PLATFORM_TUPLE,
        }
    }

    fn no_library(&self) -> FmuError {
        let folders = fs::read_dir(self.folder().join("binaries")).into_iter().flatten();
        let mut found: Vec<String> = folders
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .map(|name| format!("binaries/{name}"))
            .collect();
        found.sort();
        let wanted = self.library();
        let wanted = wanted.strip_prefix(self.folder()).unwrap_or(&wanted);
        let found = match found.is_empty() {
            true => "no binaries at all".into(),
            false => found.join(", "),
        };
        let wanted = wanted.display();
        FmuError::of(
            &self.file,
            format_args!(
                "it contains no {wanted} and cannot run on this machine; it contains {found}; export it for this platform"
            ),
        )
    }
}

fn described(file: &Path, folder: &Path) -> Result<Model, FmuError> {
    let path = folder.join("modelDescription.xml");
    let fail = |why: String| {
        FmuError::of(file, format_args!("its modelDescription.xml cannot be used: {why}"))
    };
    if !path.is_file() {
        return Err(fail("there is no such file in the FMU".into()));
    }
    let refused = |e: ModelDescriptionError| match e {
        ModelDescriptionError::UnsupportedVersion(version)
        | ModelDescriptionError::UnknownVersion(version) => {
            let which = "only FMI 2.0 and FMI 3.0 are supported: export it as one of them";
            FmuError::of(file, format_args!("it uses FMI {version}; {which}"))
        }
        ModelDescriptionError::Io(e) => fail(e.to_string()),
        e => fail(e.to_string()),
    };
    let model = match model_description::peek_fmi_major_version(&path).map_err(refused)? {
        FMIMajorVersion::V2 => Model::of_fmi2(&Description2::from_path(&path).map_err(refused)?),
        FMIMajorVersion::V3 => Model::of_fmi3(&Description3::from_path(&path).map_err(refused)?),
    };
    let exchange =
        "it is for model exchange only and contains no solver; export it for co-simulation";
    let model = model.ok_or_else(|| FmuError::of(file, exchange))?;
    // The identifier becomes a part of a path.
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    match model.identifier.chars().all(is_word) && !model.identifier.is_empty() {
        true => Ok(model),
        false => Err(fail(format!("{:?} is not a model identifier", model.identifier))),
    }
}
