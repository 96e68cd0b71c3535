//! Policy for rows that cannot be read: they are left out and counted, unless there are too many.

use crate::RecordingError;

/// At most one row in this many may be left out.
const ONE_IN: usize = 5;
/// Largest number of lines below a table that count as a footer. Further lines count as bad rows.
const FOOTER: usize = 16;
/// If there are more bad rows than good rows, reading stops after this number of bad rows.
const HOPELESS: usize = 1000;
/// Largest number of rows that a note lists completely. If there are more, the note lists one less
/// and counts the others.
const NAMED: usize = 5;

/// Rows of a table that cannot be read.
#[derive(Debug, Default)]
pub(crate) struct BadRows {
    rows: Vec<u64>,
    /// The first bad row, and what is wrong with it.
    first: Option<(u64, RecordingError)>,
    /// Number of lines with a wrong number of fields after the last good row, and (in `good`) the
    /// number of good rows up to there.
    footer: usize,
    good: usize,
    is_strict: bool,
}

impl BadRows {
    pub(crate) fn new(is_strict: bool) -> Self {
        Self { is_strict, ..Self::default() }
    }

    /// Returns whether `bad` of `all` rows may be left out.
    pub(crate) fn are_few(bad: usize, all: usize) -> bool {
        bad * ONE_IN <= all
    }

    /// How many rows are left out.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// Leaves out a row that follows `good` good ones.
    ///
    /// # Errors
    /// The option `strict` is set, too many rows are bad, or the error is about more than this row.
    #[cold]
    pub(crate) fn take(
        &mut self,
        row: u64,
        good: usize,
        error: RecordingError,
    ) -> Result<(), RecordingError> {
        if std::mem::replace(&mut self.good, good) != good {
            self.footer = 0;
        }
        self.footer += usize::from(matches!(error, RecordingError::Ragged { .. }));
        self.leave_out([row], error)?;
        if self.len() > HOPELESS && self.len() > good {
            return self.check(good);
        }
        Ok(())
    }

    /// Leaves out rows. The error is that of the first row.
    ///
    /// # Errors
    /// The option `strict` is set, or the error is about more than the row.
    pub(crate) fn leave_out(
        &mut self,
        rows: impl IntoIterator<Item = u64>,
        error: RecordingError,
    ) -> Result<(), RecordingError> {
        if self.is_strict {
            return Err(error.refused("--strict leaves no row out".to_owned()));
        }
        if error.is_about_notation() || !error.is_row() {
            return Err(error);
        }
        let before = self.rows.len();
        self.rows.extend(rows);
        let row = self.rows.get(before).copied().unwrap_or_default();
        if self.first.as_ref().is_none_or(|(first, _)| row < *first) {
            self.first = Some((row, error));
        }
        Ok(())
    }

    /// Refuses a table with `good` good rows if too many rows are bad.
    fn check(&mut self, good: usize) -> Result<(), RecordingError> {
        let is_last = self.good == good && good > 0;
        let bad = self.len() - if is_last { self.footer.min(FOOTER) } else { 0 };
        let all = bad + good;
        match self.first.take_if(|_| !Self::are_few(bad, all)) {
            None => Ok(()),
            Some((_, first)) => Err(first.refused(format!(
                "{bad} of {all} rows cannot be read, and at most one in {ONE_IN} may be left out"
            ))),
        }
    }

    /// Returns the note on the rows that were left out of a table with `good` good rows, if any.
    ///
    /// # Errors
    /// Too many rows are bad.
    pub(crate) fn finish(
        mut self,
        file: &str,
        good: usize,
    ) -> Result<Option<String>, RecordingError> {
        self.check(good)?;
        let Some((_, first)) = self.first else { return Ok(None) };
        let text = first.to_string();
        let text = text.strip_prefix(file).map_or(&*text, |text| text.trim_start_matches(", "));
        let text = text.rsplit_once("; ").map_or(text, |(evidence, _)| evidence);
        self.rows.sort_unstable();
        let names: Vec<String> = self.rows.iter().take(NAMED).map(u64::to_string).collect();
        Ok(Some(match self.rows.len() {
            1 => format!("a row is left out: {text}"),
            count if count <= NAMED => {
                format!("{count} rows are left out ({}): {text}", names.join(", "))
            }
            count => {
                let (names, more) = (names[..NAMED - 1].join(", "), count + 1 - NAMED);
                format!("{count} rows are left out ({names} and {more} more): {text}")
            }
        }))
    }
}
