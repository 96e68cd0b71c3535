//! Parquet: a table whose columns are numbers or stamps.

use ::parquet::{
    basic::{LogicalType, TimeUnit as Unit},
    column::reader::{ColumnReader, ColumnReaderImpl},
    data_type::DataType,
    errors::ParquetError,
    file::reader::{FileReader, RowGroupReader, SerializedFileReader},
    schema::types::ColumnDescriptor,
};
use bytes::Bytes;

use stretch_data::Channel;

use crate::{
    ReadOptions, RecordingError,
    clock::time_among,
    grid::{Track, note},
    options::TIME,
    room::Room,
};

/// Rows that are taken at once.
const PIECE: usize = 1 << 16;

/// Reads a file's columns, those without a value as NaN.
pub(crate) fn read(
    (bytes, mut room): (Vec<u8>, Room),
    file: &str,
    options: &ReadOptions,
) -> Result<(Vec<Track>, Vec<String>), RecordingError> {
    let fail =
        |problem| RecordingError::Format { file: file.to_owned(), format: "Parquet", problem };
    let broken = |e: ParquetError| fail(format!("{e}; write it again, or export it as CSV"));
    let reader = SerializedFileReader::new(Bytes::from(bytes)).map_err(broken)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(0);
    room.take_time(rows).map_err(fail)?;
    let (mut channels, mut stamps, mut other) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..schema.num_columns() {
        let column = schema.column(i);
        let name = column.path().string();
        if column.max_rep_level() > 0 {
            other.push(format!("{name} (lists)"));
            continue;
        }
        room.take_numbers(rows).map_err(fail)?;
        let mut values = Vec::with_capacity(rows);
        let mut is_number = true;
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group).map_err(broken)?;
            // more rows than the file says it has are no rows of it
            let its_rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
            if its_rows > rows - values.len().min(rows) {
                return Err(fail("its groups hold more rows than the file; write it again".into()));
            }
            // its pages are in memory while it is read
            let pages = usize::try_from(group.metadata().column(i).uncompressed_size());
            let pages = pages.unwrap_or(usize::MAX);
            room.take(pages as u64).map_err(fail)?;
            is_number &= numbers(group.as_ref(), i, &column, &mut values).map_err(broken)?;
            room.give_back(pages);
        }
        if !is_number || values.len() != rows {
            other.push(format!("{name} (no numbers)"));
            continue;
        }
        stamps.push(stamp_counts(&column));
        channels.push(Channel { name, values });
    }
    let mut notes = Vec::new();
    note(&mut notes, "left out", &other);
    let names: Vec<String> = channels.iter().map(|c| c.name.clone()).collect();
    let track = match (time_among(&names, options), options.sample_rate_hz) {
        (Some(time), _) => {
            let Channel { name: clock, values: counts } = channels.remove(time);
            if clock != options.time {
                notes.push(format!("the time is column {clock}"));
            }
            let per_second = stamps[time].unwrap_or_else(|| options.divisor(&clock));
            Track { clock, counts, per_second, channels }
        }
        (None, Some(rate_hz)) => {
            notes.push(format!("there is no time: {rate_hz} samples a second, as was said"));
            let counts = (0..rows).map(|i| i as f64 / rate_hz).collect();
            Track { clock: TIME.to_owned(), counts, per_second: 1.0, channels }
        }
        (None, None) => {
            let names = names.iter().map(String::as_str);
            return Err(RecordingError::missing_column(file, &options.time, names));
        }
    };
    if track.counts.is_empty() {
        return Err(RecordingError::HeaderOnly { file: file.to_owned() });
    }
    Ok((vec![track], notes))
}

/// Counts in a second, where a column holds stamps.
fn stamp_counts(column: &ColumnDescriptor) -> Option<f64> {
    let unit = match column.logical_type_ref()? {
        LogicalType::Timestamp(stamp) => stamp.unit,
        LogicalType::Time(time) => time.unit,
        _ => return None,
    };
    Some(match unit {
        Unit::MILLIS => 1e3,
        Unit::MICROS => 1e6,
        Unit::NANOS => 1e9,
    })
}

/// Appends a row group's column; false where it holds no numbers.
fn numbers(
    group: &dyn RowGroupReader,
    i: usize,
    column: &ColumnDescriptor,
    values: &mut Vec<f64>,
) -> Result<bool, ParquetError> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    let is_decimal = matches!(column.logical_type_ref(), Some(LogicalType::Decimal { .. }));
    let full = column.max_def_level();
    match group.get_column_reader(i)? {
        _ if is_decimal => return Ok(false),
        ColumnReader::BoolColumnReader(r) => {
            append(r, rows, full, values, |x| f64::from(u8::from(x)))?
        }
        ColumnReader::Int32ColumnReader(r) => append(r, rows, full, values, f64::from)?,
        ColumnReader::Int64ColumnReader(r) => append(r, rows, full, values, |x| x as f64)?,
        ColumnReader::FloatColumnReader(r) => append(r, rows, full, values, f64::from)?,
        ColumnReader::DoubleColumnReader(r) => append(r, rows, full, values, |x| x)?,
        _ => return Ok(false),
    }
    Ok(true)
}

fn append<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    full: i16,
    values: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<(), ParquetError> {
    let mut left = rows;
    let (mut read, mut levels) = (Vec::new(), Vec::new());
    while left > 0 {
        read.clear();
        levels.clear();
        let asked = (full > 0).then_some(&mut levels);
        let (records, _, _) = reader.read_records(left.min(PIECE), asked, None, &mut read)?;
        if records == 0 {
            break;
        }
        let mut read = read.drain(..).map(&number);
        if full == 0 {
            values.extend(read);
        } else {
            // A level below the full one is a row without a value.
            let whole = |level: i16| if level == full { read.next() } else { None };
            values.extend(levels.drain(..).map(whole).map(|x| x.unwrap_or(f64::NAN)));
        }
        left -= records;
    }
    Ok(())
}
