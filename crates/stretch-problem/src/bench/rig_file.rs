//! Reads rig files as simulation and diagnosis do, with the file's name in every error.

use std::path::Path;

use stretch_data::RigFile;
use stretch_sim::{GaugeRig, Rig, SimError};

use crate::error::ProblemError;

fn located(path: &Path, cause: SimError) -> ProblemError {
    ProblemError::Refused(format!("{}: {cause}", path.display()))
}

/// Reads a whole rig.
pub(crate) fn rig(path: &Path) -> Result<Rig, ProblemError> {
    Rig::from_file(&RigFile::read(path)?).map_err(|cause| located(path, cause))
}

/// Reads a gauge alone.
pub(crate) fn gauge(path: &Path) -> Result<GaugeRig, ProblemError> {
    GaugeRig::from_file(&RigFile::read(path)?).map_err(|cause| located(path, cause))
}

/// Whether the file describes a gauge alone.
pub(crate) fn is_gauge(path: &Path) -> Result<bool, ProblemError> {
    Ok(RigFile::read(path)?.kind.as_deref() == Some("gauge"))
}
