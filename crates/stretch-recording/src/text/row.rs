//! Parses the fields of one line, with a fast path for rows of numbers.

use stretch_data::shown;

use crate::FieldFault;

/// Words that tables contain in place of a missing number.
const MISSING: [&str; 5] = ["na", "n/a", "#n/a", "null", "none"];

/// What is wrong with one field, and the field, shortened, before its place is known.
pub(crate) type Fault = (FieldFault, String);

/// What is wrong with a row.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum RowFault {
    Field { column: usize, fault: Fault },
    Ragged { found: usize, expected: usize },
}

/// Use of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Each field must be a finite number.
    Needed,
    /// The column is optional: a field that is not a finite number becomes NaN.
    Welcome,
    /// The column is not read: its values are NaN.
    Skipped,
}

/// One field of a line: its content, and the position of the delimiter after it.
pub(crate) enum Field<'a> {
    Plain(&'a [u8], usize),
    Quoted(Vec<u8>, usize),
    Broken,
}

pub(crate) fn field(line: &[u8], at: usize, delimiter: u8) -> Field<'_> {
    let rest = &line[at..];
    let lead = rest.iter().take_while(|&&b| b == b' ').count();
    if rest.get(lead) != Some(&b'"') {
        let length = memchr::memchr(delimiter, rest).unwrap_or(rest.len());
        return Field::Plain(rest[..length].trim_ascii(), at + length);
    }
    let mut content = Vec::new();
    let mut i = lead + 1;
    loop {
        match (rest.get(i), rest.get(i + 1)) {
            (Some(b'"'), Some(b'"')) => {
                content.push(b'"');
                i += 2;
            }
            (Some(b'"'), _) => break,
            (Some(&byte), _) => {
                content.push(byte);
                i += 1;
            }
            (None, _) => return Field::Broken,
        }
    }
    i += 1;
    i += rest[i..].iter().take_while(|&&b| b == b' ').count();
    match rest.get(i) {
        None => Field::Quoted(content, at + i),
        Some(&byte) if byte == delimiter => Field::Quoted(content, at + i),
        Some(_) => Field::Broken,
    }
}

/// Reads a row into `out`, one number for each role. Returns false unless all fields that are read are plainly written
/// finite numbers. A separator may follow the last field.
#[inline]
pub(crate) fn numbers(line: &[u8], delimiter: u8, roles: &[Role], out: &mut [f64]) -> bool {
    let mut at = 0;
    for (&role, slot) in roles.iter().zip(out.iter_mut()) {
        if at > line.len() {
            return false;
        }
        let end = if role == Role::Skipped {
            *slot = f64::NAN;
            match field(line, at, delimiter) {
                Field::Plain(_, end) | Field::Quoted(_, end) => end,
                Field::Broken => return false,
            }
        } else {
            let Ok((value, length)) = fast_float2::parse_partial::<f64, _>(&line[at..]) else {
                return false;
            };
            if !value.is_finite() || line.get(at + length).is_some_and(|&byte| byte != delimiter) {
                return false;
            }
            *slot = value;
            at + length
        };
        at = end + 1;
    }
    at >= line.len()
}

/// Returns whether a field is a finite number. This is cheaper than [`number`], which describes the fault.
pub(crate) fn is_finite(content: &[u8]) -> bool {
    fast_float2::parse::<f64, _>(content).is_ok_and(f64::is_finite)
}

/// Parses a field as a finite number.
pub(crate) fn number(content: &[u8]) -> Result<f64, Fault> {
    match fast_float2::parse::<f64, _>(content) {
        Ok(value) if value.is_finite() => Ok(value),
        parsed => Err((fault_of(content, parsed.is_ok()), shown(content))),
    }
}

/// Says why a field is no finite number.
fn fault_of(content: &[u8], is_parsed: bool) -> FieldFault {
    let is_word = |word: &&str| content.eq_ignore_ascii_case(word.as_bytes());
    if content.is_empty() {
        return FieldFault::Empty;
    }
    if is_parsed || MISSING.iter().any(is_word) {
        return FieldFault::NotFinite;
    }
    let pointed: Vec<u8> = content.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
    match pointed != content && fast_float2::parse::<f64, _>(&pointed).is_ok() {
        true => FieldFault::DecimalComma,
        false => FieldFault::NotANumber,
    }
}
