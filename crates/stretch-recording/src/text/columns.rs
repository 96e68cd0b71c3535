//! Columns of numbers that grow by a row.

use stretch_data::{Channel, DataError, Place, Trial};

use crate::{
    ReadOptions, RecordingError,
    text::header::Header,
    text::row::{Fault, Role, RowFault},
};

/// The channels that every trial file of the format knows by name.
pub(crate) const KNOWN: [&str; 5] = ["inlet", "outlet", "pressure_kpa", "length_mm", "bridge_v"];

/// Columns that grow by a row at a time.
pub(crate) struct Columns {
    pub(crate) roles: Vec<Role>,
    time: usize,
    time_column: String,
    divisor: f64,
    /// What the time column counts from.
    origin: f64,
    /// The last time of what was cut off.
    previous_s: Option<f64>,
    time_s: Vec<f64>,
    kept: Vec<(usize, Vec<f64>)>,
}

impl Columns {
    pub(crate) fn new(
        file: &str,
        header: &Header,
        options: &ReadOptions,
    ) -> Result<Self, RecordingError> {
        let time = header.position(file, &options.time)?;
        for name in options.required() {
            header.position(file, name)?;
        }
        let role = |(i, name): (usize, &String)| match name.as_str() {
            "" => Role::Skipped,
            name if i == time || KNOWN.contains(&name) => Role::Needed,
            _ if options.required().contains(name) => Role::Needed,
            _ => Role::Welcome,
        };
        let roles: Vec<Role> = header.names.iter().enumerate().map(role).collect();
        let kept = (0..roles.len())
            .filter(|&i| i != time && roles[i] != Role::Skipped)
            .map(|i| (i, Vec::new()))
            .collect();
        Ok(Self {
            roles,
            time,
            time_column: options.time.clone(),
            divisor: options.time_divisor(),
            origin: 0.0,
            previous_s: None,
            time_s: Vec::new(),
            kept,
        })
    }

    /// Counts the time from `origin`, in the column's own unit, and so many counts make a second.
    pub(crate) fn count_from(&mut self, origin: f64, divisor: f64) {
        (self.origin, self.divisor) = (origin, divisor);
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        self.time_s.len()
    }

    #[inline]
    pub(crate) fn push(
        &mut self,
        file: &str,
        row: u64,
        values: &[f64],
    ) -> Result<(), RecordingError> {
        let time_s = (values[self.time] - self.origin) / self.divisor;
        if let Some(previous_s) = self.time_s.last().copied().or(self.previous_s)
            && time_s <= previous_s
        {
            let at = Place { file: file.to_owned(), row, column: self.time_column.clone() };
            return Err(DataError::TimeNotRising { at, time_s, previous_s }.into());
        }
        self.time_s.push(time_s);
        let mut spoilt = false;
        for (i, column) in &mut self.kept {
            let value = values[*i];
            spoilt |= value.is_nan();
            column.push(value);
        }
        if spoilt {
            self.drop_spoilt(values);
        }
        Ok(())
    }

    /// Leaves out the columns whose newest field was no number.
    #[cold]
    fn drop_spoilt(&mut self, values: &[f64]) {
        self.kept.retain(|&(i, _)| !values[i].is_nan());
        for (role, value) in self.roles.iter_mut().zip(values) {
            if value.is_nan() {
                *role = Role::Skipped;
            }
        }
    }

    /// What there is so far; rows go on behind it.
    pub(crate) fn cut(&mut self, file: &str, header: &Header) -> Trial {
        self.previous_s = self.time_s.last().copied().or(self.previous_s);
        let kept = self.kept.iter_mut().map(|(i, values)| (*i, std::mem::take(values)));
        let channel = |(i, values): (usize, _)| Channel { name: header.names[i].clone(), values };
        let channels = kept.map(channel).collect();
        Trial { name: file.to_owned(), time_s: std::mem::take(&mut self.time_s), channels }
    }

    pub(crate) fn into_trial(
        mut self,
        file: &str,
        header: &Header,
    ) -> Result<Trial, RecordingError> {
        if self.time_s.is_empty() {
            return Err(RecordingError::HeaderOnly { file: file.to_owned() });
        }
        Ok(self.cut(file, header))
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
        RowFault::Field { column, fault } => {
            let at = Place { file, row, column: header.label(column) };
            match fault {
                Fault::NotANumber(value) => RecordingError::NotANumber { at, value },
                Fault::Empty => RecordingError::EmptyField { at },
                Fault::DecimalComma(value) => RecordingError::DecimalComma { at, value },
                Fault::NotFinite(value) => DataError::NotFinite { at, value }.into(),
                Fault::NotUtf8(value) => RecordingError::NotUtf8 { at, value },
                Fault::Quote => RecordingError::Quote { at },
                Fault::DecimalPoint(value) => RecordingError::DecimalPoint { at, value },
                Fault::Stamp(value) => RecordingError::TimeStamp { at, value },
            }
        }
    }
}
