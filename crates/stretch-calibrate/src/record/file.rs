//! Calibration files, in JSON for people or in postcard (a binary format) for a board. Both forms carry a seal: a
//! digest in JSON, a checksum in postcard.

use std::{io::ErrorKind, path::Path};

use stretch_core::{Calibration, CalibrationSpec, Schema, record};
use stretch_data::files::{read_whole, write_whole};

use crate::CalibrateError;

use super::{digest, fixed::BoardReceptor};

/// Buffer size for the largest calibration in postcard, which has two poly55 surfaces and the names of sixteen trials.
const POSTCARD_BYTES: usize = 4096;

/// Treatment of the seal of a calibration file.
#[derive(Clone, Copy, PartialEq)]
enum Seal {
    /// The seal must match the content.
    Checked,
    /// The seal is ignored, because the file was edited by hand.
    Ignored,
}

/// Whether a file of that name is in postcard.
pub fn is_postcard(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "postcard")
}

/// Reads a calibration from a file: postcard if the name ends in `.postcard`, otherwise JSON.
///
/// # Errors
/// [`CalibrateError::Record`] with the file, the field and the fault. A file whose seal does not match its content is
/// refused as well.
pub fn read_calibration(path: &Path) -> Result<Calibration, CalibrateError> {
    let file = path.display().to_string();
    let problem = |problem| CalibrateError::Record { file: file.clone(), problem };
    let bytes = read_whole(path).map_err(|e| {
        // Errors of the kind `Other` come from this program and already contain advice.
        let what_to_do = match e.kind() {
            ErrorKind::Other => "",
            _ => "; give a calibration file that stretch calibrate wrote",
        };
        problem(format!("cannot read it: {e}{what_to_do}"))
    })?;
    if !is_postcard(path) {
        let text = String::from_utf8(bytes);
        let text = text.map_err(|e| problem(format!("{UNUSABLE}: it is not a text file: {e}")))?;
        return calibration_from_json(&text, &file);
    }
    // The specification is loaded without its checks, so that a message can name the field.
    let spec = record::load::<CalibrationSpec>(&bytes);
    let made = spec.and_then(Calibration::new);
    made.map_err(|e| match BoardReceptor::new(&bytes) {
        Some(board) => problem(format!(
            "it is a record of integers for a board with a converter of {} bits, which only `stretch listen` and the board read; give the \
             calibration file from which `stretch export --fixed` made it, such as cal.json",
            board.adc_bits()
        )),
        None => problem(format!("{UNUSABLE}: {e}")),
    })
}

/// Reads a calibration from JSON text. Messages call the text `name`.
///
/// # Errors
/// The errors of [`read_calibration`].
///
/// ```
/// use stretch_calibrate::{calibration_from_json, calibration_to_json};
///
/// let calibration = stretch_receptor::example_calibration();
/// let text = calibration_to_json(&calibration)?;
/// assert_eq!(calibration_from_json(&text, "cal.json")?, calibration);
/// // edited by hand: `stretch export --seal` renews the digest
/// let edited = text.replace("\"dead_band\": 0", "\"dead_band\": 1");
/// let error = calibration_from_json(&edited, "cal.json").unwrap_err().to_string();
/// assert!(error.contains("stretch export --calibration cal.json --seal"), "{error}");
/// # Ok::<(), stretch_calibrate::CalibrateError>(())
/// ```
pub fn calibration_from_json(text: &str, name: &str) -> Result<Calibration, CalibrateError> {
    from_json(text, name, Seal::Checked)
}

/// Reads a calibration from JSON text that may have been edited by hand. Its digest is not checked.
///
/// # Errors
/// The errors of [`read_calibration`], except for the digest.
pub fn calibration_from_edited_json(text: &str, name: &str) -> Result<Calibration, CalibrateError> {
    from_json(text, name, Seal::Ignored)
}

/// Returns a calibration as sealed JSON.
///
/// # Errors
/// None for a [`Calibration`], because all of its numbers are finite.
pub fn calibration_to_json(calibration: &Calibration) -> Result<String, CalibrateError> {
    digest::seal(calibration)
}

/// Returns the seal of a calibration: the CRC-32C of its bytes in postcard.
///
/// The seal identifies the calibration in other forms, such as constants in C, or a board that reports the seal of its
/// calibration.
///
/// # Errors
/// None for a [`Calibration`], because the buffer has room for the largest one.
pub fn calibration_seal(calibration: &Calibration) -> Result<u32, CalibrateError> {
    let mut buffer = [0; POSTCARD_BYTES];
    let bytes = record::store(calibration, &mut buffer)?;
    Ok(record::seal(bytes)?.unwrap_or_default())
}

/// Writes a calibration file completely or not at all: postcard if the name ends in `.postcard`, otherwise JSON.
///
/// # Errors
/// `CalibrateError::File` with path and cause.
pub fn write_calibration(path: &Path, calibration: &Calibration) -> Result<(), CalibrateError> {
    let bytes = calibration_bytes(path, calibration)?;
    Ok(write_whole(path, |out| out.write_all(&bytes))?)
}

/// Returns a calibration as the bytes of a file of that name: postcard if the name ends in `.postcard`, otherwise JSON.
///
/// # Errors
/// None for a [`Calibration`], because the buffer has room for the largest one and all numbers are finite.
pub fn calibration_bytes(
    path: &Path,
    calibration: &Calibration,
) -> Result<Vec<u8>, CalibrateError> {
    if is_postcard(path) {
        let mut buffer = [0; POSTCARD_BYTES];
        return Ok(record::store(calibration, &mut buffer)?.to_vec());
    }
    Ok(calibration_to_json(calibration)?.into_bytes())
}

const UNUSABLE: &str = "this calibration cannot be used";

/// Removes the field `turns` (turning points of movements), which `stretch-sleeve` writes; `None` if there is no such
/// field.
fn without_turns(object: &str) -> Option<serde_json::Value> {
    let mut value: serde_json::Value = serde_json::from_str(object).ok()?;
    value.as_object_mut()?.remove("turns").map(|_| value)
}

/// If a text is a file of another kind that users may mistake for a calibration, returns this kind; `None` for a
/// damaged calibration.
fn other_kind(text: &str) -> Option<&'static str> {
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
    let first = first?;
    if !first.starts_with('{') {
        let section = first.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
        let is_section = section.is_some_and(|name| name.contains(|c: char| c.is_alphabetic()));
        return match (is_section || first.contains(" = "), first.contains([',', ';', '\t', ' '])) {
            (true, _) => Some("a TOML file, such as a simulator or a problem,"),
            (false, true) => Some("a text file, such as a recording (CSV),"),
            (false, false) => None,
        };
    }
    let value: serde_json::Value = serde_json::from_str(text).ok()?;
    match ["verdict", "fits", "pooled"].map(|field| value.get(field).is_some()) {
        [true, ..] => Some("a diagnosis"),
        [_, true, _] => Some("the answer of stretch calibrate --json"),
        [.., true] => Some("the answer of stretch evaluate --json"),
        _ => None,
    }
}

fn from_json(text: &str, name: &str, seal: Seal) -> Result<Calibration, CalibrateError> {
    let unusable = |cause: String| {
        let problem = format!("{UNUSABLE}: {cause}");
        CalibrateError::Record { file: name.to_owned(), problem }
    };
    let (object, found) = digest::split(text);
    let (parsed, end) = match without_turns(&object) {
        Some(value) => (serde_path_to_error::deserialize(value), Ok(())),
        None => {
            let mut json = serde_json::Deserializer::from_str(&object);
            (serde_path_to_error::deserialize(&mut json), json.end())
        }
    };
    let spec: CalibrationSpec = parsed.map_err(|error| {
        let field = error.path().to_string();
        let cause = error.into_inner();
        if object.contains("\"largest_jump\"") {
            let problem = format!(
                "a calibration of several gauges can only be used by stretch apply, sleeve renew and export; to compare it with a \
                 reference, write its estimates with stretch apply --calibration {name} TRIAL.csv --out estimates.csv"
            );
            return CalibrateError::Record { file: name.to_owned(), problem };
        }
        if let Some(kind) = other_kind(text) {
            let problem = format!(
                "this is {kind} and not a calibration; give a file that stretch calibrate --out wrote, such as cal.json"
            );
            return CalibrateError::Record { file: name.to_owned(), problem };
        }
        unusable(if field == "." { cause.to_string() } else { format!("in {field}: {cause}") })
    })?;
    end.map_err(|error| unusable(error.to_string()))?;
    let schema = spec.schema;
    let calibration = Calibration::new(spec).map_err(|error| unusable(error.to_string()))?;
    // Files of schema 1 had no digest.
    let may_lack_it = found.is_none() && schema != Schema::CURRENT;
    if seal == Seal::Checked && !may_lack_it {
        digest::verified(text, &digest::how_to_renew(name)).map_err(unusable)?;
    }
    Ok(calibration)
}
