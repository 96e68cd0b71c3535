//! Records of one gauge or of several as files: in JSON under a digest, in postcard for a board.

use std::path::Path;

use stretch_core::{ArrayCalibration, record};
use stretch_files::read_whole;

use crate::{
    CalibrateError,
    calibration_file::{UNUSABLE, calibration_bytes, is_postcard},
    calibration_seal, calibration_to_json, digest, read_calibration,
};

use super::linear::{ROOM, SleeveCalibration};

/// Room for the largest record of several gauges in postcard: for each of sixteen that may be lost, fifteen gains of
/// each of those that are left.
const POSTCARD_BYTES: usize = 1 << 16;

/// The record of several gauges in postcard, with its seal. A board of `N` channels loads it as an
/// `ArrayCalibration<N>`, for any `N` that has room for its channels.
///
/// # Errors
/// Never, because the buffer has room for the largest record.
///
/// ```
/// use stretch_core::{ArrayCalibration, record};
/// use stretch_calibrate::array_bytes;
/// let calibration = stretch_receptor::example_array();
/// let bytes = array_bytes(&calibration)?;
/// assert_eq!(record::load::<ArrayCalibration<4>>(&bytes)?.channels.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn array_bytes<const N: usize>(
    calibration: &ArrayCalibration<N>,
) -> Result<Vec<u8>, CalibrateError> {
    let mut buffer = vec![0; POSTCARD_BYTES];
    Ok(record::store(calibration, &mut buffer)?.to_vec())
}

/// The number under which the record of several gauges is sealed: CRC-32C of [`array_bytes`].
///
/// # Errors
/// Never, as [`array_bytes`].
pub fn array_seal<const N: usize>(
    calibration: &ArrayCalibration<N>,
) -> Result<u32, CalibrateError> {
    Ok(record::seal(&array_bytes(calibration)?)?.unwrap_or_default())
}

impl SleeveCalibration {
    /// The record as the bytes of a file of that name: postcard where the name ends in `.postcard`, else JSON.
    ///
    /// # Errors
    /// Never, because buffers have room for the largest record and all numbers are finite.
    pub fn bytes(&self, path: &Path) -> Result<Vec<u8>, CalibrateError> {
        match self {
            Self::One(calibration) => calibration_bytes(path, calibration),
            Self::Many(calibration) if is_postcard(path) => array_bytes(calibration),
            Self::Many(_) => Ok(self.to_json()?.into_bytes()),
        }
    }

    /// The number under which the record is sealed: CRC-32C of its bytes in postcard.
    ///
    /// # Errors
    /// Never, as [`bytes`](Self::bytes).
    pub fn seal(&self) -> Result<u32, CalibrateError> {
        match self {
            Self::One(calibration) => calibration_seal(calibration),
            Self::Many(calibration) => array_seal(calibration),
        }
    }

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
        let one = || read_calibration(path).map(|calibration| Self::One(Box::new(calibration)));
        let bytes = read_whole(path).unwrap_or_default();
        if is_postcard(path) {
            let several = record::load::<ArrayCalibration<ROOM>>(&bytes);
            // what is neither is told as what most records are
            return several.map_or_else(|_| one(), |several| Ok(Self::Many(Box::new(several))));
        }
        let text = String::from_utf8(bytes).unwrap_or_default();
        let (object, found) = digest::split(&text);
        let value: Option<serde_json::Value> = serde_json::from_str(&object).ok();
        if value.as_ref().is_none_or(|value| value.get("channels").is_none()) {
            return one();
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
            .map_err(|error| problem(format!("{UNUSABLE}: {error}")))?;
        Ok(Self::Many(Box::new(calibration)))
    }
}
