//! Columns of numbers that are filled row by row.

use stretch_data::{Channel, Place};

use crate::{
    ReadOptions, RecordingError,
    clock::{Rows, Stamps},
    grid::{Track, is_needed, sparse},
    text::bad_rows::BadRows,
    text::header::Header,
    text::row::{Role, RowFault},
};

/// Names of the channels that the project's format of trial files defines.
pub(crate) const KNOWN: [&str; 5] = ["inlet", "outlet", "pressure_kpa", "length_mm", "bridge_v"];
/// Number of fields with words instead of numbers, above which a column may be text.
const MOST_HOLES: usize = 16;

/// Columns that are filled row by row.
pub(crate) struct Columns {
    pub(crate) roles: Vec<Role>,
    /// Value of the time column, or number of preceding samples if samples are counted.
    counts: Vec<f64>,
    rows: Rows,
    kept: Vec<Kept>,
    /// Whether columns are kept that were not requested.
    keeps_all: bool,
    /// Holes: samples in which a field is not a finite number.
    holes: Vec<usize>,
}

/// A column that is kept as long as nearly all of its fields are numbers or blank.
struct Kept {
    column: usize,
    values: Vec<f64>,
    holes: usize,
    /// Number of holes that contain words: the field is neither blank nor a number such as NaN.
    words: usize,
    /// Error of the first field that is not a number.
    first: Option<RecordingError>,
}

impl Columns {
    /// Creates the columns of a header. `time` is the index of the time column. `is_counted` means that samples are
    /// counted and the time column is not read.
    pub(crate) fn new(
        file: &str,
        header: &Header,
        time: Option<usize>,
        is_counted: bool,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        for name in options.required() {
            header.position(file, name)?;
        }
        let role = |(i, name): (usize, &String)| match name.as_str() {
            _ if Some(i) == time && is_counted => Role::Skipped,
            name if Some(i) == time || options.required().iter().any(|r| r == name) => Role::Needed,
            "" => Role::Skipped,
            _ if i >= header.recorded => Role::Skipped,
            name if is_needed(name, options) => Role::Needed,
            _ => Role::Welcome,
        };
        let roles: Vec<Role> = header.names.iter().enumerate().map(role).collect();
        let kept = (0..roles.len())
            .filter(|&i| Some(i) != time && roles[i] != Role::Skipped)
            .map(|column| Kept { column, values: Vec::new(), holes: 0, words: 0, first: None })
            .collect();
        let keeps_all = options.all_columns || options.required().is_empty();
        let (counts, rows, holes) = (Vec::new(), Rows::default(), Vec::new());
        Ok(Self { roles, counts, rows, kept, keeps_all, holes })
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        self.counts.len()
    }

    #[inline]
    pub(crate) fn push(&mut self, row: u64, count: f64, values: &[f64]) {
        self.counts.push(count);
        self.rows.push(row);
        for kept in &mut self.kept {
            kept.values.push(values[kept.column]);
        }
    }

    /// Records which fields of the newest row are not numbers. A column of text is dropped.
    #[cold]
    pub(crate) fn spoil(&mut self, fields: impl IntoIterator<Item = (usize, RecordingError)>) {
        let count = self.len();
        self.holes.push(count - 1);
        for (column, error) in fields {
            let Some(at) = self.kept.iter().position(|kept| kept.column == column) else {
                continue;
            };
            let kept = &mut self.kept[at];
            kept.holes += 1;
            kept.words += usize::from(!error.is_blank());
            kept.first.get_or_insert(error);
            if kept.words > MOST_HOLES && !BadRows::are_few(kept.words, count) {
                self.roles[column] = Role::Skipped;
                self.kept.remove(at);
            }
        }
    }

    /// Converts the columns to tracks: one, or several if the table is sparse. Leaves out rows with holes if they are
    /// few. Otherwise leaves out the columns with holes that are not needed. Rows in which a needed column has a hole
    /// then count as bad rows.
    pub(crate) fn into_tracks(
        mut self,
        header: &Header,
        stamps: Stamps,
        options: &ReadOptions,
        bad: &mut BadRows,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Track>, RecordingError> {
        let count = self.len();
        self.kept.retain(|kept| kept.words == 0 || BadRows::are_few(kept.words, count));
        let name = |kept: &Kept| header.names[kept.column].clone();
        let mut first: Vec<(String, RecordingError)> = Vec::new();
        for kept in &mut self.kept {
            first.extend(kept.first.take().map(|error| (name(kept), error)));
        }
        let channel = |kept: Kept| Channel { name: name(&kept), values: kept.values };
        let channels = self.kept.into_iter().map(channel).collect();
        let track = Track::new(Stamps { counts: self.counts, rows: self.rows, ..stamps }, channels);
        let mut tracks = match self.holes.is_empty() {
            true => vec![track],
            false => sparse(track, options, notes),
        };
        let Some(table) = tracks.first_mut().filter(|t| t.stamps.counts.len() == count) else {
            return Ok(tracks);
        };
        let is_needed = |c: &Channel| is_needed(&c.name, options);
        let holes_of = |c: &Channel| self.holes.iter().filter(|i| c.values[**i].is_nan()).count();
        // If columns are requested, no row is left out because of another column.
        let most = if self.keeps_all { count } else { 0 };
        table.channels.retain(|c| is_needed(c) || BadRows::are_few(holes_of(c), most));
        let rows_with_holes = |channels: &[Channel]| -> Vec<usize> {
            let is_hole = |i: &&usize| {
                channels.iter().any(|c| c.values[**i].is_nan() && !options.may_have_gaps(&c.name))
            };
            self.holes.iter().filter(is_hole).copied().collect()
        };
        let mut holes = rows_with_holes(&table.channels);
        if !BadRows::are_few(holes.len() + bad.len(), count + bad.len()) {
            table.channels.retain(|c| is_needed(c) || holes_of(c) == 0);
            holes = rows_with_holes(&table.channels);
        }
        first.retain(|(name, _)| {
            !options.may_have_gaps(name) && table.channels.iter().any(|c| c.name == *name)
        });
        let first = first.into_iter().map(|(_, error)| error).min_by_key(RecordingError::row);
        if let Some(first) = first {
            bad.leave_out(holes.iter().map(|i| table.stamps.rows.row(*i)), first)?;
            table.remove(&holes);
        }
        Ok(tracks)
    }
}

/// The error for a fault, with its place.
#[cold]
pub(crate) fn located(file: &str, row: u64, header: &Header, fault: RowFault) -> RecordingError {
    let file = file.to_owned();
    match fault {
        RowFault::Ragged { found, expected } => {
            RecordingError::Ragged { file, row, found, expected }
        }
        RowFault::Field { column, fault: (fault, value) } => {
            let at = Place { file, row, column: header.label(column) };
            RecordingError::Field { at, value, fault }
        }
    }
}
