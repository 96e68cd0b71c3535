//! A column of a Parquet file, with a number or a list of numbers in each row.

use ::parquet::{
    basic::{ConvertedType as Kind, LogicalType, TimeUnit as Unit},
    column::reader::{ColumnReader, ColumnReaderImpl},
    data_type::DataType,
    errors::ParquetError,
    file::reader::{FileReader, RowGroupReader},
    schema::types::ColumnDescriptor,
};

use stretch_data::Channel;

use crate::room::Room;

/// Number of rows that are read at once.
const PIECE: usize = 1 << 16;
/// Greatest length of the lists in a column whose items become one channel each.
const LONGEST: usize = 64;
/// Memory, in bytes, that each number of a list takes while it is read. It covers two copies of the number, its two
/// Parquet levels and the index at which its list begins, in vectors that may have grown to twice their length.
const LISTED: u64 = 48;

/// Numbers of a column as they are read.
#[derive(Debug, Default)]
struct Values {
    numbers: Vec<f64>,
    /// For a column of lists: index in `numbers` at which the list of each row begins.
    begins: Vec<usize>,
}

/// Why a column gives no channels.
pub(super) enum Refused {
    /// The column does not contain numbers. The file can be read without it.
    LeftOut(String),
    /// The file cannot be read.
    File(String),
    /// Error of the Parquet library.
    Damaged(ParquetError),
}

impl From<ParquetError> for Refused {
    fn from(error: ParquetError) -> Self {
        Self::Damaged(error)
    }
}

/// Reads column `i` of a file with `rows` rows. Returns one channel, or one per list item if the rows contain lists of
/// equal length. Missing values are NaN.
pub(super) fn read(
    file: &dyn FileReader,
    i: usize,
    rows: usize,
    room: &mut Room,
) -> Result<Vec<Channel>, Refused> {
    let column = file.metadata().file_metadata().schema_descr().column(i);
    if column.max_rep_level() > 1 {
        return Err(Refused::LeftOut("lists of lists".to_owned()));
    }
    let is_list = column.max_rep_level() > 0;
    room.take_numbers(rows).map_err(Refused::File)?;
    let mut values = Values::default();
    if !is_list {
        values.numbers.reserve_exact(rows);
    }
    for group in 0..file.num_row_groups() {
        let group = file.get_row_group(group)?;
        // Refuse row groups with more rows than the metadata of the file declares.
        let its_rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
        let have = if is_list { values.begins.len() } else { values.numbers.len() };
        if its_rows > rows - have.min(rows) {
            let why = "its row groups contain more rows than the file declares; write it again";
            return Err(Refused::File(why.to_owned()));
        }
        // The pages of a row group are in memory while it is read.
        let pages = usize::try_from(group.metadata().column(i).uncompressed_size());
        let pages = pages.unwrap_or(usize::MAX);
        room.take(pages as u64).map_err(Refused::File)?;
        if is_list {
            let listed = levels(group.as_ref(), i)?;
            room.take(LISTED.saturating_mul(listed)).map_err(Refused::File)?;
        }
        if !append_group(group.as_ref(), i, &column, &mut values)? {
            return Err(Refused::LeftOut("no numbers".to_owned()));
        }
        room.give_back(pages);
    }
    match is_list {
        true => values.items(&column.path().parts()[0], rows).map_err(Refused::LeftOut),
        false if values.numbers.len() != rows => Err(Refused::LeftOut("no numbers".to_owned())),
        false => Ok(vec![Channel { name: column.path().string(), values: values.numbers }]),
    }
}

/// Returns the counts per second, if a column contains time stamps.
pub(super) fn stamp_counts(column: &ColumnDescriptor) -> Option<f64> {
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

impl Values {
    /// Returns one channel for each item of lists of equal length: `action.0`, `action.1` ...
    fn items(&self, name: &str, rows: usize) -> Result<Vec<Channel>, String> {
        let count = self.numbers.len().checked_div(rows).unwrap_or(0);
        let begins = self.begins.iter().enumerate();
        let is_even = self.begins.len() == rows
            && self.numbers.len() == rows * count
            && begins.into_iter().all(|(row, begin)| *begin == row * count);
        match count {
            _ if !is_even || count == 0 => Err("lists of different lengths".to_owned()),
            _ if count > LONGEST => Err(format!("lists of more than {LONGEST} numbers")),
            _ => Ok((0..count)
                .map(|item| Channel {
                    name: format!("{name}.{item}"),
                    values: self.numbers[item..].iter().step_by(count).copied().collect(),
                })
                .collect()),
        }
    }
}

/// Counts the values in a column of a row group, including empty lists, from the page headers.
fn levels(group: &dyn RowGroupReader, i: usize) -> Result<u64, ParquetError> {
    let (mut pages, mut all) = (group.get_column_page_reader(i)?, 0_u64);
    while let Some(page) = pages.peek_next_page()? {
        // An older page states only a number of rows, which then equals the number of values.
        let values = page.num_levels.or(page.num_rows).unwrap_or(0);
        all = all.saturating_add(if page.is_dict { 0 } else { values as u64 });
        pages.skip_next_page()?;
    }
    Ok(all)
}

/// Appends a column of a row group. Returns false if the column does not contain numbers.
fn append_group(
    group: &dyn RowGroupReader,
    i: usize,
    column: &ColumnDescriptor,
    into: &mut Values,
) -> Result<bool, ParquetError> {
    let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
    if matches!(column.logical_type_ref(), Some(LogicalType::Decimal { .. })) {
        return Ok(false);
    }
    let levels = (column.max_def_level(), column.max_rep_level());
    let is_unsigned = matches!(
        column.converted_type(),
        Kind::UINT_8 | Kind::UINT_16 | Kind::UINT_32 | Kind::UINT_64
    );
    match group.get_column_reader(i)? {
        ColumnReader::BoolColumnReader(r) => {
            append(r, rows, levels, into, |x| f64::from(u8::from(x)))?;
        }
        ColumnReader::Int32ColumnReader(r) if is_unsigned => {
            append(r, rows, levels, into, |x| x.cast_unsigned().into())?;
        }
        ColumnReader::Int64ColumnReader(r) if is_unsigned => {
            append(r, rows, levels, into, |x| x.cast_unsigned() as f64)?;
        }
        ColumnReader::Int32ColumnReader(r) => append(r, rows, levels, into, f64::from)?,
        ColumnReader::Int64ColumnReader(r) => append(r, rows, levels, into, |x| x as f64)?,
        ColumnReader::FloatColumnReader(r) => append(r, rows, levels, into, f64::from)?,
        ColumnReader::DoubleColumnReader(r) => append(r, rows, levels, into, |x| x)?,
        _ => return Ok(false),
    }
    Ok(true)
}

fn append<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    (full, deep): (i16, i16),
    into: &mut Values,
    number: impl Fn(T::T) -> f64,
) -> Result<(), ParquetError> {
    let mut left = rows;
    let (mut read, mut levels, mut lists) = (Vec::new(), Vec::new(), Vec::new());
    while left > 0 {
        read.clear();
        levels.clear();
        lists.clear();
        let (asked, asked_lists) =
            ((full > 0).then_some(&mut levels), (deep > 0).then_some(&mut lists));
        let (records, ..) = reader.read_records(left.min(PIECE), asked, asked_lists, &mut read)?;
        if records == 0 {
            break;
        }
        // A repetition level of 0 begins the list of the next row.
        let first = into.numbers.len();
        let begins = lists.iter().enumerate().filter(|(_, level)| **level == 0);
        into.begins.extend(begins.map(|(i, _)| first + i));
        let mut read = read.drain(..).map(&number);
        if full == 0 {
            into.numbers.extend(read);
        } else {
            // A definition level below the maximum means that the value is missing.
            let whole = |level: i16| if level == full { read.next() } else { None };
            into.numbers.extend(levels.drain(..).map(whole).map(|x| x.unwrap_or(f64::NAN)));
        }
        left -= records;
    }
    Ok(())
}
