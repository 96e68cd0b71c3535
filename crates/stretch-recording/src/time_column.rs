//! The source of a recording's time, from text.

use std::{fmt, str::FromStr};

use serde::Serialize;

use crate::options::{DateOrder, ReadOptions, TIME, TimeUnit};

/// The source of a recording's time in the notation of users: a column, optionally with a colon and a unit or an order
/// of dates, or a rate.
///
/// ```
/// use stretch_recording::{TimeColumn, TimeUnit};
/// let time: TimeColumn = "stamp:ms".parse()?;
/// assert_eq!(time, TimeColumn::Named("stamp".into(), Some(TimeUnit::Milliseconds)));
/// assert_eq!("100hz".parse(), Ok(TimeColumn::Rate(100.0)));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum TimeColumn {
    /// A column, and its unit if one is given.
    Named(String, Option<TimeUnit>),
    /// A column with dates, and the order of day and month.
    Dated(String, DateOrder),
    /// No column is read; samples have this rate, Hz.
    Rate(f64),
}

impl FromStr for TimeColumn {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.to_ascii_lowercase();
        if let Some(Ok(_)) = number.strip_suffix("hz").map(str::parse::<f64>) {
            return parse_rate(number.trim_end_matches("hz")).map(Self::Rate);
        }
        let order = |end: &str| match end {
            "dmy" => Some(DateOrder::DayFirst),
            "mdy" => Some(DateOrder::MonthFirst),
            _ => None,
        };
        let dated = text.rsplit_once(':').and_then(|(name, end)| Some((name, order(end)?)));
        if let Some((name, order)) = dated {
            return Ok(Self::Dated(name.to_owned(), order));
        }
        let text = if text.starts_with(':') { format!("{TIME}{text}") } else { text.to_owned() };
        let split =
            text.rsplit_once(':').and_then(|(name, end)| Some((name, TimeUnit::abbreviated(end)?)));
        Ok(match split {
            Some((name, unit)) => Self::Named(name.to_owned(), Some(unit)),
            None => Self::Named(text.to_owned(), None),
        })
    }
}

/// Writes the notation of users, from which the same source can be parsed.
///
/// ```
/// use stretch_recording::TimeColumn;
/// for text in ["time_s", "stamp:ms", "Datum:dmy", "100hz"] {
///     assert_eq!(text.parse::<TimeColumn>()?.to_string(), text);
/// }
/// # Ok::<(), String>(())
/// ```
impl fmt::Display for TimeColumn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Named(name, None) => f.write_str(name),
            Self::Named(name, Some(unit)) => {
                write!(f, "{name}:")?;
                unit.serialize(f)
            }
            Self::Dated(name, DateOrder::DayFirst) => write!(f, "{name}:dmy"),
            Self::Dated(name, DateOrder::MonthFirst) => write!(f, "{name}:mdy"),
            Self::Rate(rate_hz) => write!(f, "{rate_hz}hz"),
        }
    }
}

impl TimeColumn {
    /// Returns the text for a calibration file. The text is empty for the default column. It is also empty for a rate,
    /// because the calibration file contains the sample rate.
    pub fn stored(&self) -> String {
        match self {
            Self::Named(name, None) if name == TIME => String::new(),
            Self::Rate(_) => String::new(),
            _ => self.to_string(),
        }
    }

    /// Returns the reading options for this source of time.
    pub fn options(&self) -> ReadOptions {
        let options = ReadOptions::new();
        match self {
            Self::Named(name, None) => options.time(name),
            Self::Named(name, Some(unit)) => options.time(name).time_unit(*unit),
            Self::Dated(name, order) => options.time(name).date_order(*order),
            Self::Rate(rate_hz) => options.sample_rate_hz(*rate_hz),
        }
    }
}

/// Parses a sample rate, Hz.
///
/// ```
/// assert_eq!(stretch_recording::parse_rate("12.5"), Ok(12.5));
/// ```
///
/// # Errors
/// A sentence, if the text is not a number from 1e-3 to 1e7.
pub fn parse_rate(text: &str) -> Result<f64, String> {
    let rate_hz = text.parse::<f64>().ok().filter(|hz| (1e-3..=1e7).contains(hz));
    rate_hz.ok_or_else(|| format!("\"{text}\" is not a rate between 1e-3 and 1e7 Hz"))
}

#[cfg(test)]
mod tests {
    use super::{DateOrder, TimeColumn, TimeUnit};

    #[test]
    fn a_time_is_a_column_with_or_without_a_unit_or_a_rate() {
        let named = |name: &str, unit| Ok(TimeColumn::Named(name.to_owned(), unit));
        assert_eq!("t_ms".parse(), named("t_ms", None));
        assert_eq!("stamp:us".parse(), named("stamp", Some(TimeUnit::Microseconds)));
        assert_eq!("ros:stamp".parse(), named("ros:stamp", None));
        let dated = TimeColumn::Dated("Datum".to_owned(), DateOrder::MonthFirst);
        assert_eq!("Datum:mdy".parse(), Ok(dated));
        assert_eq!("12.5Hz".parse(), Ok(TimeColumn::Rate(12.5)));
        assert_eq!("hz".parse(), named("hz", None));
        assert!("1e9hz".parse::<TimeColumn>().unwrap_err().contains("between 1e-3 and 1e7"));
    }
}
