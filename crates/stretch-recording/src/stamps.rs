//! Time stamps written as text: ISO 8601 and other dates with a time of day, and a time of day alone.

use std::borrow::Cow;

use crate::{DateOrder, FieldFault};

/// Returns a time stamp in nanoseconds: since 1970 for a date, since midnight for a time of day. A date without a time
/// zone is in UTC. The day comes first if points separate the numbers of a date and `order` is `None`.
pub(crate) fn nanoseconds(text: &str, order: Option<DateOrder>) -> Result<i128, FieldFault> {
    use jiff::{Timestamp, civil::DateTime, civil::Time, tz::TimeZone};
    if let Ok(stamp) = text.parse::<Timestamp>() {
        return Ok(stamp.as_nanosecond());
    }
    // A date without a time of day is not the time of a sample, but the parser below would take it for midnight.
    if !text.contains(':') {
        return Err(FieldFault::Stamp);
    }
    let (date, time) = match text.split_once([' ', 'T']) {
        Some((date, time)) if !date.contains(':') => (Some(date), time.trim_start()),
        _ => (None, text),
    };
    let mut time = of_day(time);
    let unknown = |_| FieldFault::Stamp;
    let Some(date) = date else {
        // A text with one colon and a fraction is minutes and seconds, because only seconds have a fraction.
        if time.contains('.') && time.matches(':').count() == 1 {
            time = Cow::Owned(format!("00:{time}"));
        }
        let time = time.parse::<Time>().map_err(unknown)?;
        return Ok(time.duration_since(Time::midnight()).as_nanos());
    };
    let (year, month, day) = numbered(date, order)?;
    let civil = format!("{year:04}-{month:02}-{day:02}T{time}").parse::<DateTime>();
    let zoned = civil.and_then(|civil| civil.to_zoned(TimeZone::UTC)).map_err(unknown)?;
    Ok(zoned.timestamp().as_nanosecond())
}

/// Rewrites a time of day with a two-digit hour from 0 to 23 and with a decimal point.
fn of_day(time: &str) -> Cow<'_, str> {
    let half = |end: &str| {
        let at = time.len().checked_sub(end.len())?;
        let (head, tail) = time.split_at_checked(at)?;
        tail.eq_ignore_ascii_case(end).then(|| head.trim_end())
    };
    let (time, afternoon) = match (half("am"), half("pm")) {
        (Some(time), _) => (time, Some(0)),
        (_, Some(time)) => (time, Some(12)),
        _ => (time, None),
    };
    let Some((hour, rest)) = time.split_once(':') else { return Cow::Borrowed(time) };
    match (hour.parse::<u32>(), afternoon) {
        (Ok(hour @ 1..=12), Some(later)) => {
            Cow::Owned(format!("{:02}:{}", hour % 12 + later, rest.replace(',', ".")))
        }
        (Ok(hour), None) => Cow::Owned(format!("{hour:02}:{}", rest.replace(',', "."))),
        _ => Cow::Borrowed(time),
    }
}

/// Splits a numeric date into year, month and day.
fn numbered(date: &str, order: Option<DateOrder>) -> Result<(u32, u32, u32), FieldFault> {
    let parts: Option<Vec<u32>> = date.split(['.', '/', '-']).map(|p| p.parse().ok()).collect();
    let Some([first, second, last]) = parts.as_deref() else { return Err(FieldFault::Stamp) };
    if *first > 31 {
        return Ok((*first, *second, *last));
    }
    let year = if *last < 100 { 2000 + last } else { *last };
    let shown = match (first, second) {
        _ if date.contains('.') => Some(DateOrder::DayFirst),
        (13.., _) => Some(DateOrder::DayFirst),
        (_, 13..) => Some(DateOrder::MonthFirst),
        (first, second) if first == second => Some(DateOrder::DayFirst),
        _ => None,
    };
    match order.or(shown) {
        Some(DateOrder::DayFirst) => Ok((year, *second, *first)),
        Some(DateOrder::MonthFirst) => Ok((year, *first, *second)),
        None => Err(FieldFault::DayOrMonth),
    }
}

/// Returns the order of day and month, if only one order is possible.
pub(crate) fn order_of(text: &str) -> Option<DateOrder> {
    let day_first = nanoseconds(text, Some(DateOrder::DayFirst));
    let month_first = nanoseconds(text, Some(DateOrder::MonthFirst));
    match (day_first, month_first) {
        (Ok(_), Err(_)) => Some(DateOrder::DayFirst),
        (Err(_), Ok(_)) => Some(DateOrder::MonthFirst),
        _ => None,
    }
}

/// Returns whether a text looks like a date or a time of day, even if it cannot be parsed.
pub(crate) fn looks_like_stamp(text: &str) -> bool {
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    match text.as_bytes().get(digits) {
        Some(b':') => (1..=2).contains(&digits),
        Some(b'-' | b'/' | b'.') => {
            let mut parts = text.split(['-', '/', '.', 'T', ' ', ':']);
            let is_number =
                |p: Option<&str>| p.is_some_and(|p| p.bytes().all(|b| b.is_ascii_digit()));
            let three = (0..3).all(|_| is_number(parts.next()));
            three && digits > 0 && (text.len() >= 8)
        }
        _ => false,
    }
}

/// Seconds since 1970 as a date, for a note.
pub(crate) fn date(epoch_s: f64) -> String {
    match jiff::Timestamp::from_millisecond((epoch_s * 1e3).round() as i64) {
        Ok(stamp) => stamp.to_string(),
        Err(_) => format!("{epoch_s} s after the beginning of 1970"),
    }
}
