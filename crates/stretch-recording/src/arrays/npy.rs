//! NumPy's arrays: one in an NPY file, several in an NPZ archive.
//!
//! The header is parsed here and not with the crate `npyz`, because `npyz` has 70 dependencies, among them an old `zip`
//! and a build from assembly, and allocates as much memory as a header asks for.

use std::io::Cursor;

use crate::{
    ReadOptions, RecordingError, TimeUnit,
    arrays::{Array, beside, tracks},
    grid::{Track, listed, note},
    names::time_rank,
    room::Room,
    sniff::EXCEL,
};

type Tracks = (Vec<Track>, Vec<String>);

/// Reads an NPY file. Its columns have names in the file, or the option `columns` names them.
pub(crate) fn read(
    (bytes, mut room): (Vec<u8>, Room),
    file: &str,
    options: &ReadOptions,
) -> Result<Tracks, RecordingError> {
    let fail = |problem: String| RecordingError::format(file, "NPY", problem);
    let mut arrays = parse(&bytes, "", options, &mut room).map_err(fail)?.map_err(fail)?;
    drop(bytes);
    if let (Some(names), [array]) = (&options.columns, &mut arrays[..]) {
        arrays = named(array, names).map_err(fail)?;
    }
    let has_time = arrays.iter().any(|a| a.name == options.time || time_rank(&a.name).is_some());
    if arrays.len() == 1
        && arrays[0].name.is_empty()
        && options.sample_rate_hz.is_none()
        && !has_time
    {
        let shape = &arrays[0].shape;
        return Err(fail(format!(
            "an array of shape {shape:?} has no column names; name its columns with --columns, or save several arrays with numpy.savez"
        )));
    }
    for (i, array) in arrays.iter_mut().enumerate().filter(|(_, a)| a.name.is_empty()) {
        array.name = format!("column_{i}");
    }
    beside(&arrays, &mut room).map_err(fail)?;
    tracks(file, arrays, Vec::new(), options)
}

/// Reads an archive of arrays.
pub(crate) fn read_archive(
    (bytes, mut room): (Vec<u8>, Room),
    file: &str,
    options: &ReadOptions,
) -> Result<Tracks, RecordingError> {
    let fail = |problem: String| RecordingError::format(file, "NPZ", problem);
    let broken = |e: zip::result::ZipError| {
        fail(format!("the archive is broken: {e}; save it again with numpy.savez"))
    };
    // The names of the members are not compressed, so they can also be read in a broken archive.
    if let Some((format, todo)) = foreign(&bytes) {
        return Err(RecordingError::format(file, format, todo));
    }
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(broken)?;
    let (mut arrays, mut other) = (Vec::new(), Vec::new());
    for i in 0..archive.len() {
        let mut member = archive.by_index(i).map_err(broken)?;
        let path = member.name().map_err(broken)?.into_owned();
        let Some(name) = path.strip_suffix(".npy") else { continue };
        let read = room.unpack(&mut member);
        let read =
            read.map_err(|e| fail(format!("array {name}: {e}; save it again with numpy.savez")))?;
        let content = read.map_err(|full| fail(format!("array {name}: {full}")))?;
        match parse(&content, name, options, &mut room).map_err(fail)? {
            Ok(found) => {
                arrays.extend(found);
                room.give_back(content.len());
            }
            Err(problem) => other.push(format!("{name} ({problem})")),
        }
    }
    if arrays.is_empty() {
        let other = listed(&other);
        return Err(fail(format!("none of its arrays contains numbers that can be read: {other}")));
    }
    drop(archive);
    let mut notes = Vec::new();
    note(&mut notes, "left out", &other);
    beside(&arrays, &mut room).map_err(fail)?;
    tracks(file, arrays, notes, options)
}

/// Returns the format of a ZIP archive without NumPy's arrays, and what to do; `None` if it contains arrays.
fn foreign(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let holds = |name: &[u8]| bytes.windows(name.len()).any(|part| part == name);
    match holds {
        _ if holds(b".npy") => None,
        _ if holds(b"[Content_Types].xml") || holds(b"xl/work") => Some(("Excel", EXCEL)),
        _ if holds(b"opendocument.spreadsheet") || holds(b"content.xml") => {
            Some(("OpenDocument", EXCEL))
        }
        _ => Some(("ZIP", "unpack it, and give the recording itself")),
    }
}

/// Splits a matrix into columns with the given names.
fn named(array: &Array, names: &[String]) -> Result<Vec<Array>, String> {
    let (rows, columns) = match array.shape[..] {
        [rows] => (rows, 1),
        [rows, columns] => (rows, columns),
        _ => {
            return Err(format!(
                "an array of shape {:?} has no columns to name; save an array of one or two dimensions",
                array.shape
            ));
        }
    };
    let count = names.len();
    let (step, next, samples) = match (columns == count, rows == count) {
        (true, _) => (columns, 1, rows),
        (_, true) => (1, columns, columns),
        _ => {
            return Err(format!(
                "an array of shape {:?} does not have the {count} columns that --columns names; give one name per column",
                array.shape
            ));
        }
    };
    let values = |i: usize| (0..samples).map(|k| array.values[k * step + i * next]).collect();
    let one = |(i, name): (usize, &String)| Array {
        name: name.clone(),
        shape: vec![samples],
        values: values(i),
    };
    Ok(names.iter().enumerate().map(one).collect())
}

/// Binary type of a number.
#[derive(Debug, Clone, PartialEq)]
struct Kind {
    is_big: bool,
    letter: u8,
    bytes: usize,
    /// Counts per second of a date or a duration; 1 for other types.
    per_second: f64,
}

impl Kind {
    /// Parses NumPy's notation: `<f8`, `|b1`, `<M8[ns]`.
    fn parse(text: &str) -> Result<Self, String> {
        let fail = || format!("numbers of type {text} are not read; save them as float64");
        let mut letters = text.bytes();
        let (order, letter) = (letters.next().ok_or_else(fail)?, letters.next().ok_or_else(fail)?);
        let rest = text.get(2..).ok_or_else(fail)?;
        if letter == b'O' {
            return Err("Python objects are not read; save numbers".to_owned());
        }
        let (size, unit) = rest.split_once('[').unwrap_or((rest, ""));
        let bytes = size.parse().map_err(|_| fail())?;
        let per_second = match unit.trim_end_matches(']') {
            "" => 1.0,
            unit => TimeUnit::abbreviated(unit).ok_or_else(fail)?.per_second(),
        };
        match (letter, bytes) {
            (b'f', 4 | 8) | (b'i' | b'u', 1 | 2 | 4 | 8) | (b'b', 1) | (b'M' | b'm', 8) => {
                Ok(Self { is_big: order == b'>', letter, bytes, per_second })
            }
            _ => Err(fail()),
        }
    }

    fn value(&self, item: &[u8]) -> f64 {
        let word = word(item, self.is_big);
        match (self.letter, self.bytes) {
            (b'f', 8) => f64::from_bits(word),
            (b'f', _) => f32::from_bits(word as u32).into(),
            (b'i' | b'M' | b'm', _) => signed(word, self.bytes),
            _ => word as f64,
        }
    }
}

/// A field of an item: its name, its offset in bytes, and its type.
type Place = (String, usize, Kind);

/// Contents of an array's header.
struct Head {
    fields: Vec<Place>,
    shape: Vec<usize>,
    is_fortran: bool,
    /// Number of items, bytes per item, and offset of the first item.
    count: usize,
    item: usize,
    begin: usize,
}

/// Parses one NPY file. Returns one array, or one per field of a structured array. The outer error means that the
/// memory limit for the whole file is exceeded; the inner error is about this array only.
fn parse(
    bytes: &[u8],
    name: &str,
    options: &ReadOptions,
    room: &mut Room,
) -> Result<Result<Vec<Array>, String>, String> {
    let Head { fields, mut shape, is_fortran, count, item, begin } = match head(bytes, name) {
        Ok(head) => head,
        Err(problem) => return Ok(Err(problem)),
    };
    room.take_numbers(count.saturating_mul(fields.len()))?;
    let data = &bytes[begin..];
    // A matrix is stored by columns; arrays of more dimensions keep the order of their bytes.
    let by_columns = match (is_fortran, &shape[..]) {
        (true, &[rows, columns]) => Some((rows, columns)),
        (true, _) => {
            shape.reverse();
            None
        }
        (false, _) => None,
    };
    let array = |(name, at, kind): Place| {
        // Dates are converted to the unit in which the reader of the time column will count them.
        let scale = match kind.letter {
            b'M' | b'm' => options.divisor(&name) / kind.per_second,
            _ => 1.0,
        };
        let value = |i: usize| {
            let i = by_columns.map_or(i, |(rows, columns)| i % columns * rows + i / columns);
            kind.value(&data[i * item + at..i * item + at + kind.bytes]) * scale
        };
        Array { name, shape: shape.clone(), values: (0..count).map(value).collect() }
    };
    Ok(Ok(fields.into_iter().map(array).collect()))
}

/// Reads an array's header and checks that all values are present.
fn head(bytes: &[u8], name: &str) -> Result<Head, String> {
    let broken = || "it ends within its header; save it again with numpy.save".to_owned();
    let wide = bytes.get(6).is_some_and(|&version| version >= 2);
    let length = match bytes.get(8..12) {
        Some(&[a, b, c, d]) if wide => u32::from_le_bytes([a, b, c, d]) as usize,
        Some(&[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
        _ => return Err(broken()),
    };
    let begin = if wide { 12_usize } else { 10 };
    let data = begin.checked_add(length).ok_or_else(broken)?;
    let header = bytes.get(begin..data).ok_or_else(broken)?;
    let header = String::from_utf8_lossy(header);
    let after = |key: &str| {
        let (_, rest) = header.split_once(&format!("'{key}'"))?;
        Some(rest.split_once(':')?.1.trim_start())
    };
    let descr = after("descr").ok_or_else(broken)?;
    let is_fortran = after("fortran_order").ok_or_else(broken)?.starts_with("True");
    let shape = after("shape").and_then(|s| s.strip_prefix('(')).and_then(|s| s.split_once(')'));
    let shape: Vec<usize> = shape
        .ok_or_else(broken)?
        .0
        .split(',')
        .map(str::trim)
        .filter(|s| !s.is_empty())
        .map(|s| s.parse().map_err(|_| broken()))
        .collect::<Result<_, _>>()?;
    let (fields, item) = fields(descr, name)?;
    let product = shape.iter().try_fold(1_usize, |n, &m| n.checked_mul(m));
    let count = product.ok_or_else(|| {
        format!("its shape {shape:?} is too large for any memory; save it again with numpy.save")
    })?;
    let needed = count.saturating_mul(item);
    if bytes.len() - data < needed {
        return Err(format!(
            "it ends before the last of its {count} values; save it again with numpy.save"
        ));
    }
    Ok(Head { fields, shape, is_fortran, count, item, begin: data })
}

/// Returns the fields of an item and its length in bytes.
fn fields(descr: &str, name: &str) -> Result<(Vec<Place>, usize), String> {
    let quoted = |text: &str| -> Vec<String> {
        text.split('\'').skip(1).step_by(2).map(str::to_owned).collect()
    };
    let Some(list) = descr.strip_prefix('[') else {
        let text = quoted(descr).into_iter().next().unwrap_or_default();
        let kind = Kind::parse(&text)?;
        let bytes = kind.bytes;
        return Ok((vec![(name.to_owned(), 0, kind)], bytes));
    };
    let list = list.split_once(']').map_or(list, |(list, _)| list);
    // The type of a date, such as `<M8[ns]`, also contains a closing bracket. The list ends at the last `],`.
    let whole = descr.rsplit_once("],").map_or(list, |(list, _)| list.trim_start_matches('['));
    let (mut places, mut at) = (Vec::new(), 0);
    for field in whole.split("),").filter(|f| f.contains('\'')) {
        let [field_name, text] = &quoted(field)[..] else {
            return Err("nested fields are not supported; save plain columns".to_owned());
        };
        if field
            .trim_end()
            .trim_end_matches(')')
            .trim_end()
            .rsplit('\'')
            .next()
            .is_some_and(|r| r.contains('('))
        {
            return Err(format!("field {field_name} contains arrays; save plain columns"));
        }
        let kind = Kind::parse(text)?;
        let path =
            if name.is_empty() { field_name.clone() } else { format!("{name}.{field_name}") };
        let bytes = kind.bytes;
        places.push((path, at, kind));
        at += bytes;
    }
    Ok((places, at))
}

/// Returns an unsigned integer of at most eight bytes.
fn word(bytes: &[u8], is_big: bool) -> u64 {
    let push = |word: u64, byte: &u8| word << 8 | u64::from(*byte);
    if is_big { bytes.iter().fold(0, push) } else { bytes.iter().rev().fold(0, push) }
}

/// Returns the value of a two's complement integer of `bytes` bytes.
fn signed(word: u64, bytes: usize) -> f64 {
    let unused = 64 - 8 * bytes as u32;
    (((word << unused) as i64) >> unused) as f64
}
