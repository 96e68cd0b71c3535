//! Calibration records as JSON files.

use std::path::Path;

use stretch_core::Calibration;
use stretch_data::write_whole;

use crate::CalibrateError;

/// A calibration from its JSON record.
///
/// # Errors
/// [`CalibrateError::Record`] with the file, the field and what is wrong with it.
pub fn read_calibration(path: &Path) -> Result<Calibration, CalibrateError> {
    let file = path.display().to_string();
    let problem = |problem| CalibrateError::Record { file: file.clone(), problem };
    let text = std::fs::read_to_string(path).map_err(|e| {
        problem(format!("cannot read it: {e}; name a record made by stretch calibrate"))
    })?;
    let mut json = serde_json::Deserializer::from_str(&text);
    serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let path = error.path().to_string();
        let cause = error.into_inner();
        let place = if path == "." { String::new() } else { format!("in {path}: ") };
        problem(format!("this is no calibration that can be used: {place}{cause}"))
    })
}

/// Writes a calibration as a JSON record, whole or not at all.
///
/// # Errors
/// [`CalibrateError::Data`] with path and cause.
pub fn write_calibration(path: &Path, calibration: &Calibration) -> Result<(), CalibrateError> {
    write_whole(path, |out| {
        serde_json::to_writer_pretty(&mut *out, calibration)?;
        out.write_all(b"\n")
    })?;
    Ok(())
}
