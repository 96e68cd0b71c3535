//! Files of calibrations of one or several gauges: JSON with a digest, or postcard for a board.

use std::path::Path;

use serde::{Deserialize, Serialize};
use stretch_calibrate::{
    BoardReceptor, CalibrateError, calibration_from_edited_json, calibration_from_json,
    calibration_seal, digest, is_postcard, read_calibration,
};
use stretch_core::{Calibration, CalibrationSpec, record};
use stretch_data::files::{read_whole, rewrites, write_whole};

use crate::{ArrayCalibration, GaugeCalibration, MAX_CHANNELS, Turns};

/// Buffer size for the largest calibration of several gauges in postcard. For the loss of each of
/// sixteen gauges, that calibration has fifteen gains for each remaining gauge.
const POSTCARD_BYTES: usize = 1 << 16;

/// Ending of the name of a postcard file that contains more than a calibration.
const SLEEVE_ENDING: &str = ".sleeve.postcard";

/// Problem of a file with turning points of an earlier form, which has a limit for a running mean.
const EARLIER_TURNS: &str = "its field turns was written by an earlier release; calibrate again";

/// A calibration of one gauge or of several.
///
/// The JSON file of one gauge contains a calibration and the additional field `turns` (turning
/// points), which programs that read only a calibration skip. The postcard file contains the
/// calibration without the turning points, for a board that does not watch the zero. It contains
/// them if the file name ends in `.sleeve.postcard`.
#[derive(Debug, Clone, PartialEq)]
pub enum SleeveCalibration {
    /// Calibration of one gauge.
    One(Box<GaugeCalibration>),
    /// Calibration of several gauges.
    Many(Box<ArrayCalibration<MAX_CHANNELS>>),
}

/// The calibration of one gauge as text.
#[derive(Serialize)]
struct InText<'a> {
    #[serde(flatten)]
    calibration: &'a CalibrationSpec,
    #[serde(skip_serializing_if = "Option::is_none")]
    turns: Option<&'a Turns>,
}

/// The fields of a text file in addition to those of a calibration.
#[derive(Deserialize)]
struct Beside {
    #[serde(default)]
    turns: Option<Turns>,
}

/// Returns the calibration of several gauges in postcard, with its seal (a checksum). A board of
/// `N` channels loads it as an `ArrayCalibration<N>`, for any `N` that is at least the number of
/// its channels.
///
/// # Errors
/// Never, because the buffer has room for the largest calibration.
///
/// ```
/// use stretch_core::record;
/// use stretch_sleeve::{ArrayCalibration, array_bytes, example_array};
/// let bytes = array_bytes(&example_array())?;
/// assert_eq!(record::load::<ArrayCalibration<4>>(&bytes)?.spec().channels.len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn array_bytes<const N: usize>(
    calibration: &ArrayCalibration<N>,
) -> Result<Vec<u8>, CalibrateError> {
    stored(calibration)
}

/// Returns the seal (checksum) of the calibration of several gauges: the CRC-32C of [`array_bytes`].
///
/// # Errors
/// Never: see [`array_bytes`].
pub fn array_seal<const N: usize>(
    calibration: &ArrayCalibration<N>,
) -> Result<u32, CalibrateError> {
    Ok(record::seal(&array_bytes(calibration)?)?.unwrap_or_default())
}

fn stored(value: &impl Serialize) -> Result<Vec<u8>, CalibrateError> {
    let mut buffer = vec![0; POSTCARD_BYTES];
    Ok(record::store(value, &mut buffer)?.to_vec())
}

fn is_sleeve_postcard(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().ends_with(SLEEVE_ENDING))
}

impl GaugeCalibration {
    /// Reads the calibration of one gauge: postcard if the file name ends in `.postcard`, otherwise
    /// JSON.
    ///
    /// # Errors
    /// [`CalibrateError::Record`] with the file, the field and its fault.
    pub fn read(path: &Path) -> Result<Self, CalibrateError> {
        let bytes = read_whole(path).unwrap_or_default();
        if is_postcard(path)
            && let Ok(gauge) = record::load(&bytes)
        {
            return Ok(gauge);
        }
        match String::from_utf8(bytes) {
            Ok(text) if !is_postcard(path) && !text.is_empty() => {
                Self::from_json(&text, &path.display().to_string())
            }
            // The file contains a calibration alone. A file without any calibration gets the error
            // for this most common kind.
            _ => Ok(Self::new(read_calibration(path)?, None)?),
        }
    }

    /// Reads the calibration from a JSON text. Messages call it `name`.
    ///
    /// # Errors
    /// The errors of [`read`](Self::read).
    pub fn from_json(text: &str, name: &str) -> Result<Self, CalibrateError> {
        Self::with_turns_of(text, name, calibration_from_json(text, name)?)
    }

    /// Combines a calibration with the turning points in its text.
    fn with_turns_of(
        text: &str,
        name: &str,
        calibration: Calibration,
    ) -> Result<Self, CalibrateError> {
        let (object, _) = digest::split(text);
        let Beside { turns } =
            digest::parse(&object).map_err(|error| match object.contains("\"mean_limit\"") {
                true => unusable(name, EARLIER_TURNS),
                false => unusable(name, error),
            })?;
        Self::new(calibration, turns).map_err(|error| unusable(name, error))
    }

    /// Returns the calibration in JSON, with its digest.
    ///
    /// # Errors
    /// Never, because all of its numbers are finite.
    pub fn to_json(&self) -> Result<String, CalibrateError> {
        digest::seal(&InText { calibration: self.calibration().spec(), turns: self.turns() })
    }

    /// Returns the bytes of a file with this name: the calibration alone if the name ends in
    /// `.postcard`, everything if it ends in `.sleeve.postcard`, and otherwise JSON.
    ///
    /// # Errors
    /// Never, because buffers have room for the largest calibration and all numbers are finite.
    pub fn bytes(&self, path: &Path) -> Result<Vec<u8>, CalibrateError> {
        match path {
            path if is_sleeve_postcard(path) => stored(self),
            path if is_postcard(path) => stored(self.calibration()),
            _ => Ok(self.to_json()?.into_bytes()),
        }
    }

    /// Writes the calibration, completely or not at all.
    ///
    /// # Errors
    /// [`CalibrateError::File`] with path and cause.
    pub fn write(&self, path: &Path) -> Result<(), CalibrateError> {
        let bytes = self.bytes(path)?;
        Ok(write_whole(path, |out| out.write_all(&bytes))?)
    }
}

impl SleeveCalibration {
    /// Returns the bytes of a file with this name: postcard if the name ends in `.postcard`,
    /// otherwise JSON.
    ///
    /// # Errors
    /// Never: see [`GaugeCalibration::bytes`].
    pub fn bytes(&self, path: &Path) -> Result<Vec<u8>, CalibrateError> {
        match self {
            Self::One(gauge) => gauge.bytes(path),
            Self::Many(several) if is_postcard(path) => array_bytes(several),
            Self::Many(several) => Ok(digest::seal(&**several)?.into_bytes()),
        }
    }

    /// Returns the seal: CRC-32C of the bytes in postcard. For one gauge, these are the bytes of
    /// the calibration alone.
    ///
    /// # Errors
    /// Never: see [`bytes`](Self::bytes).
    pub fn seal(&self) -> Result<u32, CalibrateError> {
        match self {
            Self::One(gauge) => calibration_seal(gauge.calibration()),
            Self::Many(several) => array_seal(several),
        }
    }

    /// Reads a calibration of one gauge or of several.
    ///
    /// # Errors
    /// [`CalibrateError::Record`] with the file, the field and its fault.
    pub fn read(path: &Path) -> Result<Self, CalibrateError> {
        let one = || GaugeCalibration::read(path).map(|gauge| Self::One(Box::new(gauge)));
        let bytes = read_whole(path).unwrap_or_default();
        if is_postcard(path) {
            let several = record::load(&bytes).map(|several| Self::Many(Box::new(several)));
            // If the file contains neither kind, report the error for the most common one.
            return several.or_else(|_| one());
        }
        let text = String::from_utf8(bytes).unwrap_or_default();
        if !is_of_several(&text) {
            return one();
        }
        let file = path.display().to_string();
        let object = digest::verified(&text, &digest::how_to_renew(&file));
        Self::of_several(&object.map_err(|error| unusable(&file, error))?, &file)
    }

    /// Reads the calibration of several gauges from a JSON object without its digest.
    fn of_several(object: &str, name: &str) -> Result<Self, CalibrateError> {
        let several = digest::parse(object).map_err(|error| unusable(name, error))?;
        Ok(Self::Many(Box::new(several)))
    }
}

fn is_of_several(text: &str) -> bool {
    let value: Option<serde_json::Value> = serde_json::from_str(text).ok();
    value.is_some_and(|value| value.get("channels").is_some())
}

fn unusable(file: &str, cause: impl std::fmt::Display) -> CalibrateError {
    let problem = format!("this calibration cannot be used: {cause}");
    CalibrateError::Record { file: file.to_owned(), problem }
}

/// Checks a calibration file of one gauge or of several that was edited by hand or has an earlier
/// schema, and writes it again with a valid seal and the current schema. A damaged postcard file is
/// refused, because postcard cannot be edited by hand.
///
/// # Errors
/// The errors of [`SleeveCalibration::read`], except for an invalid digest, and the errors of writing.
pub fn seal_record(path: &Path) -> Result<SleeveCalibration, CalibrateError> {
    let text = read_whole(path).ok().and_then(|bytes| String::from_utf8(bytes).ok());
    let file = path.display().to_string();
    let record = match text.filter(|_| !is_postcard(path)) {
        Some(text) if is_of_several(&text) => {
            SleeveCalibration::of_several(&digest::split(&text).0, &file)?
        }
        Some(text) => {
            let calibration = calibration_from_edited_json(&text, &file)?;
            let gauge = GaugeCalibration::with_turns_of(&text, &file, calibration)?;
            SleeveCalibration::One(Box::new(gauge))
        }
        None => SleeveCalibration::read(path)?,
    };
    let bytes = record.bytes(path)?;
    rewrites(path);
    write_whole(path, |out| out.write_all(&bytes))?;
    Ok(record)
}

/// Kind and seal of a calibration file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RecordSummary {
    /// The model, or the type that reads the file on a board.
    pub kind: String,
    /// CRC-32C of the calibration's bytes in postcard.
    pub seal: u32,
    /// Whether the file contains this checksum. Files of schema 1 do not.
    pub is_sealed: bool,
}

/// Describes a calibration file, or a file that `--fixed` wrote for a board.
///
/// # Errors
/// The errors of [`SleeveCalibration::read`].
pub fn describe_record(path: &Path) -> Result<RecordSummary, CalibrateError> {
    let bytes = read_whole(path).unwrap_or_default();
    if let Some(receptor) = BoardReceptor::new(&bytes)
        && let Ok(found) = record::seal(&bytes)
    {
        let kind = format!("a live estimator for converter codes of {} bits", receptor.adc_bits());
        let seal = found.unwrap_or_else(|| record::checksum(&bytes));
        return Ok(RecordSummary { kind, seal, is_sealed: found.is_some() });
    }
    let calibration = SleeveCalibration::read(path)?;
    let is_sealed = match is_postcard(path) {
        true => matches!(record::seal(&bytes), Ok(Some(_))),
        false => digest::split(&String::from_utf8_lossy(&bytes)).1.is_some(),
    };
    let kind = match &calibration {
        SleeveCalibration::One(one) => {
            format!("a calibration, {}", one.calibration().spec().model.name())
        }
        SleeveCalibration::Many(many) => {
            format!("a calibration of {} gauges", many.spec().channels.len())
        }
    };
    Ok(RecordSummary { kind, seal: calibration.seal()?, is_sealed })
}
