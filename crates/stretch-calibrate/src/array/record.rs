//! Records of one gauge or of several as files in JSON, under a digest.

use std::path::Path;

use stretch_core::ArrayCalibration;
use stretch_files::read_whole;

use crate::{CalibrateError, calibration_to_json, digest, read_calibration};

use super::linear::{ROOM, SleeveCalibration};

impl SleeveCalibration {
    /// The record in JSON, sealed.
    ///
    /// # Errors
    /// Never, because all of its numbers are finite.
    pub fn to_json(&self) -> Result<String, CalibrateError> {
        let problem = |problem: String| CalibrateError::Record { file: "record".into(), problem };
        match self {
            Self::One(calibration) => calibration_to_json(calibration),
            Self::Many(calibration) => {
                let object = serde_json::to_string_pretty(&**calibration);
                let object = object.map_err(|error| problem(error.to_string()))?;
                digest::join(&object).ok_or_else(|| problem("it is no object".into()))
            }
        }
    }

    /// Reads a record of one gauge, or of several.
    ///
    /// # Errors
    /// [`CalibrateError::Record`] with the file, the field and its fault.
    pub fn read(path: &Path) -> Result<Self, CalibrateError> {
        let bytes = read_whole(path).unwrap_or_default();
        let text = String::from_utf8(bytes).unwrap_or_default();
        let (object, found) = digest::split(&text);
        let value: Option<serde_json::Value> = serde_json::from_str(&object).ok();
        if value.as_ref().is_none_or(|value| value.get("channels").is_none()) {
            return read_calibration(path).map(|calibration| Self::One(Box::new(calibration)));
        }
        let file = path.display().to_string();
        let problem = |problem: String| CalibrateError::Record { file: file.clone(), problem };
        if found != Some(digest::digest(&object).as_str()) {
            return Err(problem(
                "its digest is not that of its text, so it was edited or damaged; calibrate again"
                    .into(),
            ));
        }
        let mut json = serde_json::Deserializer::from_str(&object);
        let calibration: ArrayCalibration<ROOM> = serde_path_to_error::deserialize(&mut json)
            .map_err(|error| {
                problem(format!("this is no calibration that can be used: {error}"))
            })?;
        Ok(Self::Many(Box::new(calibration)))
    }
}
