//! Fields of one line: numbers by the fast way, anything unusual by the careful one.

use stretch_data::shown;

/// What is wrong with one field or one row, before it is known where it stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fault {
    NotANumber(String),
    Empty,
    DecimalComma(String),
    NotFinite(String),
    NotUtf8(String),
    Quote,
    DecimalPoint(String),
    Stamp(String),
}

/// What a row is at fault for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum RowFault {
    Field { column: usize, fault: Fault },
    Ragged { found: usize, expected: usize },
}

/// How a column takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Role {
    /// Must be a finite number.
    Needed,
    /// NaN where it is none.
    Welcome,
    /// Not looked at; NaN.
    Skipped,
}

/// The field that starts at `at`: its content, and where its delimiter stands.
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

/// Reads a row of numbers into `out`, one for each role.
#[inline]
pub(crate) fn numbers(
    line: &[u8],
    delimiter: u8,
    roles: &[Role],
    out: &mut [f64],
) -> Result<(), RowFault> {
    let mut at = 0;
    let last = roles.len() - 1;
    for (column, (&role, slot)) in roles.iter().zip(out.iter_mut()).enumerate() {
        let fast = if role == Role::Skipped { None } else { fast_number(line, at, delimiter) };
        let (value, end) = match fast {
            Some(found) => found,
            None => careful_number(line, at, delimiter, role)
                .map_err(|fault| row_fault(line, delimiter, roles.len(), column, fault))?,
        };
        *slot = value;
        if (end == line.len()) != (column == last) {
            return Err(ragged(line, delimiter, roles.len()));
        }
        at = end + 1;
    }
    Ok(())
}

#[inline]
fn fast_number(line: &[u8], at: usize, delimiter: u8) -> Option<(f64, usize)> {
    let (value, length) = fast_float2::parse_partial::<f64, _>(&line[at..]).ok()?;
    let end = at + length;
    let closed = line.get(end).is_none_or(|&byte| byte == delimiter);
    (closed && value.is_finite()).then_some((value, end))
}

#[cold]
fn careful_number(
    line: &[u8],
    at: usize,
    delimiter: u8,
    role: Role,
) -> Result<(f64, usize), Fault> {
    let (result, end) = match field(line, at, delimiter) {
        Field::Broken => return Err(Fault::Quote),
        Field::Plain(_, end) | Field::Quoted(_, end) if role == Role::Skipped => {
            return Ok((f64::NAN, end));
        }
        Field::Plain(content, end) => (number(content), end),
        Field::Quoted(content, end) => (number(content.trim_ascii()), end),
    };
    match result {
        Ok(value) => Ok((value, end)),
        Err(_) if role == Role::Welcome => Ok((f64::NAN, end)),
        Err(fault) => Err(fault),
    }
}

/// The finite number that a whole field spells.
pub(crate) fn number(content: &[u8]) -> Result<f64, Fault> {
    match fast_float2::parse::<f64, _>(content) {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(Fault::NotFinite(shown(content))),
        Err(_) if content.is_empty() => Err(Fault::Empty),
        Err(_) if core::str::from_utf8(content).is_err() => Err(Fault::NotUtf8(shown(content))),
        Err(_) => {
            let pointed: Vec<u8> =
                content.iter().map(|&b| if b == b',' { b'.' } else { b }).collect();
            if pointed != content && fast_float2::parse::<f64, _>(&pointed).is_ok() {
                return Err(Fault::DecimalComma(shown(content)));
            }
            Err(Fault::NotANumber(shown(content)))
        }
    }
}

/// A row of another length is ragged before any of its fields is at fault.
#[cold]
fn row_fault(line: &[u8], delimiter: u8, expected: usize, column: usize, fault: Fault) -> RowFault {
    match ragged(line, delimiter, expected) {
        RowFault::Ragged { found, .. } if found == expected || fault == Fault::Quote => {
            RowFault::Field { column, fault }
        }
        ragged => ragged,
    }
}

#[cold]
fn ragged(line: &[u8], delimiter: u8, expected: usize) -> RowFault {
    let (mut found, mut at) = (0, 0);
    loop {
        found += 1;
        at = match field(line, at, delimiter) {
            Field::Plain(_, end) | Field::Quoted(_, end) if end < line.len() => end + 1,
            _ => return RowFault::Ragged { found, expected },
        };
    }
}
