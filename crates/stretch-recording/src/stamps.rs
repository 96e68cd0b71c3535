//! Time stamps written as dates: ISO 8601, and a time of day alone.

/// Nanoseconds that a stamp stands for: since 1970 for a date, since midnight for a time of day; none where it is no stamp.
/// A date without a zone counts as UTC.
#[cfg(feature = "iso-time")]
pub(crate) fn nanoseconds(text: &str) -> Option<i128> {
    use jiff::{Timestamp, civil::DateTime, civil::Time, tz::TimeZone};
    if let Ok(stamp) = text.parse::<Timestamp>() {
        return Some(stamp.as_nanosecond());
    }
    // A date alone is no sample's time, and the parser would take it for midnight.
    if text.contains(':') {
        if let Ok(civil) = text.parse::<DateTime>() {
            return civil.to_zoned(TimeZone::UTC).ok().map(|z| z.timestamp().as_nanosecond());
        }
        let time = text.parse::<Time>().ok()?;
        let seconds = i128::from(time.hour()) * 3600
            + i128::from(time.minute()) * 60
            + i128::from(time.second());
        return Some(seconds * 1_000_000_000 + i128::from(time.subsec_nanosecond()));
    }
    None
}

/// No stamp is understood: the feature `iso-time` is off.
#[cfg(not(feature = "iso-time"))]
pub(crate) fn nanoseconds(_text: &str) -> Option<i128> {
    None
}

/// Whether a text has the look of a date or a time of day, understood or not.
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

/// A stamp in words, for a note: seconds since 1970 as a date where dates are understood.
pub(crate) fn date(epoch_s: f64) -> String {
    #[cfg(feature = "iso-time")]
    if let Ok(stamp) = jiff::Timestamp::from_millisecond((epoch_s * 1e3).round() as i64) {
        return stamp.to_string();
    }
    format!("{epoch_s} s after the beginning of 1970")
}
