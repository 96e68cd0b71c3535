//! The digest of a record in JSON: the record's last field, computed over every other byte that is no white space.

use serde::{Serialize, de::DeserializeOwned};
use serde_path_to_error::Error;
use stretch_core::record::checksum;

use crate::CalibrateError;

/// The white space of JSON, and no other.
const SPACE: [char; 4] = [' ', '\n', '\r', '\t'];

/// The digest of an object as the text of the digest field: `crc32c 5a0e17c3`.
///
/// White space outside of strings does not count, so that a record can be reformatted. The order of the fields and
/// the spelling of numbers count.
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

/// The object without its digest, and the digest where the object has one. Where other fields follow it the fields were put in another
/// order, which no digest survives.
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

/// The object of a record whose digest is that of its text.
///
/// # Errors
/// What is wrong with the digest, and the advice: what to do.
pub fn verified(text: &str, advice: &str) -> Result<String, String> {
    let (object, found) = split(text);
    let computed = digest(&object);
    match found {
        Some(found) if found == computed => Ok(object),
        Some(found) => Err(format!(
            "its digest is {found} and its text gives {computed}: it was edited or damaged, or its fields were sorted; {advice}"
        )),
        None => Err(format!("it has no digest; {advice}")),
    }
}

/// What to do about a calibration whose digest is not that of its text.
pub fn how_to_renew(file: &str) -> String {
    format!(
        "check every number, then renew it with: stretch export --calibration {file} --seal; or calibrate again"
    )
}

/// The value of an object without its digest.
///
/// # Errors
/// The fault, and the field that has it.
pub fn parse<T: DeserializeOwned>(object: &str) -> Result<T, Error<serde_json::Error>> {
    serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_str(object))
}

/// The object with its digest behind the last field.
pub fn join(object: &str) -> Option<String> {
    let open = trimmed(trimmed(object).strip_suffix('}')?);
    Some(format!("{open},\n  \"digest\": \"{}\"\n}}\n", digest(object)))
}

/// A record in indented JSON, with its digest as the last field.
///
/// # Errors
/// [`CalibrateError::Record`] for what is no object, or has numbers that are not finite.
pub fn seal(record: &impl Serialize) -> Result<String, CalibrateError> {
    let problem = |problem| CalibrateError::Record { file: "record".to_owned(), problem };
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
        // a quote that is escaped ends no string
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
