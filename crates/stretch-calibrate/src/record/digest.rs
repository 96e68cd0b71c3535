//! The digest of a JSON calibration file. It is the last field and covers every other byte except white space.

use serde::{Serialize, de::DeserializeOwned};
use serde_path_to_error::Error;
use stretch_core::record::checksum;

use crate::CalibrateError;

/// The white space characters of JSON.
const SPACE: [char; 4] = [' ', '\n', '\r', '\t'];

/// Returns the digest of an object as the text of the digest field: `crc32c 5a0e17c3`.
///
/// White space outside strings is ignored, so a file can be reformatted. The order of the fields and the spelling of
/// numbers matter.
pub fn digest(object: &str) -> String {
    let (mut in_string, mut escaped) = (false, false);
    let counts = |byte: &u8| {
        if in_string {
            in_string = escaped || *byte != b'"';
            escaped = !escaped && *byte == b'\\';
            return true;
        }
        in_string = *byte == b'"';
        !matches!(byte, b' ' | b'\n' | b'\r' | b'\t')
    };
    let bytes: Vec<u8> = object.bytes().filter(counts).collect();
    format!("crc32c {:08x}", checksum(&bytes))
}

/// Returns the object without its digest, and the digest if there is one. If other fields follow the digest, the fields
/// were reordered, and the digest no longer matches.
pub fn split(text: &str) -> (String, Option<String>) {
    let cut = || {
        let text = trimmed(trimmed(text).strip_suffix('}')?);
        let (before, digest) = text.strip_suffix('"')?.rsplit_once('"')?;
        let before = trimmed(trimmed(before).strip_suffix(':')?).strip_suffix("\"digest\"")?;
        Some((format!("{}}}", trimmed(before).strip_suffix(',')?), digest.to_owned()))
    };
    let taken = || {
        let mut value: serde_json::Value = serde_json::from_str(text).ok()?;
        let digest = value.as_object_mut()?.remove("digest")?.as_str()?.to_owned();
        Some((value.to_string(), digest))
    };
    match cut().or_else(taken) {
        Some((object, digest)) => (object, Some(digest)),
        None => (text.to_owned(), None),
    }
}

/// Returns the object of a file whose digest matches its text.
///
/// # Errors
/// Describes the fault of the digest, followed by `advice`.
pub fn verified(text: &str, advice: &str) -> Result<String, String> {
    let (object, found) = split(text);
    let computed = digest(&object);
    match found {
        Some(found) if found == computed => Ok(object),
        Some(found) => Err(format!(
            "its digest is {found}, but its text has the digest {computed}: it was edited or damaged, or its fields were sorted; {advice}"
        )),
        None => Err(format!("it has no digest; {advice}")),
    }
}

/// Returns advice about a calibration file whose digest does not match its text.
pub fn how_to_renew(file: &str) -> String {
    format!(
        "check every number, then renew it with: stretch export --calibration {file} --seal; or calibrate again"
    )
}

/// Parses an object without its digest.
///
/// # Errors
/// The fault, and the field that contains it.
pub fn parse<T: DeserializeOwned>(object: &str) -> Result<T, Error<serde_json::Error>> {
    serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_str(object))
}

/// Appends the digest to an object as its last field; `None` if the text is not a JSON object.
pub fn join(object: &str) -> Option<String> {
    let open = trimmed(trimmed(object).strip_suffix('}')?);
    Some(format!("{open},\n  \"digest\": \"{}\"\n}}\n", digest(object)))
}

/// Returns a calibration file as indented JSON with the digest as its last field.
///
/// # Errors
/// [`CalibrateError::Record`] if the calibration file is not an object, or has numbers that are not finite.
pub fn seal(record: &impl Serialize) -> Result<String, CalibrateError> {
    let problem = |problem| CalibrateError::Record { file: "calibration".to_owned(), problem };
    let object = serde_json::to_string_pretty(record).map_err(|e| problem(e.to_string()))?;
    join(&object).ok_or_else(|| problem("it is not a JSON object".to_owned()))
}

fn trimmed(text: &str) -> &str {
    text.trim_end_matches(SPACE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_space_between_does_not_count_and_all_else_does() {
        let same = ["{\"a\": [1, 2],\n\t\"b\": \"c d\"}", "{\"a\":[1,2],\"b\":\"c d\"}\r\n"];
        assert_eq!(digest(same[0]), digest(same[1]));
        for other in [
            "{\"a\":[1,2],\"b\":\"cd\"}",
            "{\"a\":[1,2.0],\"b\":\"c d\"}",
            "{\"b\":\"c d\",\"a\":[1,2]}",
            "{\"a\":[1,2],\"b\":\"c\\\" d\"}",
        ] {
            assert_ne!(digest(same[0]), digest(other), "{other}");
        }
        // An escaped quote does not end a string.
        assert_ne!(digest(r#"{"a":"\" x"}"#), digest(r#"{"a":"\"x"}"#));
        assert_eq!(digest(r#"{"a":"\\" }"#), digest(r#"{"a":"\\"}"#));
    }

    #[test]
    fn what_is_joined_is_split_again() {
        let object = "{\n  \"a\": 1.5\n}";
        let text = join(object).unwrap();
        let (back, found) = split(&text);
        assert_eq!(found, Some(digest(&back)));
        assert_eq!(digest(&back), digest(object));
        assert_eq!(split(object), (object.to_owned(), None));
    }
}
