//! Calibration records as files: JSON for people, postcard for a board.

use std::path::Path;

use stretch_core::Calibration;
use stretch_data::{read_whole, write_whole};

use crate::CalibrateError;

/// Room for the largest record in postcard: two poly55 surfaces and sixteen trials.
const POSTCARD_BYTES: usize = 4096;

fn is_postcard(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "postcard")
}

/// A calibration from its record: postcard when the name ends in `.postcard`, else JSON.
///
/// # Errors
/// [`CalibrateError::Record`] with the file, the field and what is wrong with it.
pub fn read_calibration(path: &Path) -> Result<Calibration, CalibrateError> {
    let file = path.display().to_string();
    let problem = |problem| CalibrateError::Record { file: file.clone(), problem };
    let bytes = read_whole(path).map_err(|e| {
        problem(format!("cannot read it: {e}; name a record made by stretch calibrate"))
    })?;
    let unusable =
        |cause: String| problem(format!("this is no calibration that can be used: {cause}"));
    if is_postcard(path) {
        return postcard::from_bytes(&bytes).map_err(|e| unusable(e.to_string()));
    }
    let mut json = serde_json::Deserializer::from_slice(&bytes);
    serde_path_to_error::deserialize(&mut json).map_err(|error| {
        let field = error.path().to_string();
        let cause = error.into_inner();
        unusable(if field == "." { cause.to_string() } else { format!("in {field}: {cause}") })
    })
}

/// Writes a calibration record, whole or not at all: postcard when the name ends
/// in `.postcard`, else JSON.
///
/// # Errors
/// [`CalibrateError::Data`] with path and cause.
pub fn write_calibration(path: &Path, calibration: &Calibration) -> Result<(), CalibrateError> {
    write_whole(path, |out| {
        if is_postcard(path) {
            let mut buffer = [0; POSTCARD_BYTES];
            let bytes =
                postcard::to_slice(calibration, &mut buffer).map_err(std::io::Error::other)?;
            return out.write_all(bytes);
        }
        serde_json::to_writer_pretty(&mut *out, calibration)?;
        out.write_all(b"\n")
    })?;
    Ok(())
}
