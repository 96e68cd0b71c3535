//! Numbers in sentences: rounded to significant digits.

/// Rounds a number to significant digits. A number that is not finite stays as it is.
///
/// ```
/// assert_eq!(stretch_data::significant(0.012_345, 3), 0.0123);
/// ```
pub fn significant(x: f64, digits: usize) -> f64 {
    format!("{x:.*e}", digits.saturating_sub(1)).parse().unwrap_or(x)
}

/// Returns a unit as it follows a number: a blank and the unit, or nothing if the unit is `1` or empty.
///
/// ```
/// let text = ["mm", "1", ""].map(|unit| format!("4.5{}", stretch_data::after_number(unit)));
/// assert_eq!(text, ["4.5 mm", "4.5", "4.5"]);
/// ```
pub fn after_number(unit: &str) -> String {
    if unit == "1" || unit.is_empty() { String::new() } else { format!(" {unit}") }
}

/// Returns the command that resamples a recording to a rate in Hz, for advice in an error.
///
/// ```
/// let command = stretch_data::resampling(100.000_001);
/// assert_eq!(command, "stretch convert OLD --grid 100 --out NEW.csv");
/// ```
pub fn resampling(rate_hz: f64) -> String {
    format!("stretch convert OLD --grid {} --out NEW.csv", in_digits(rate_hz, 6))
}

/// Writes a number with at most `digits` significant digits, without trailing zeros: in plain
/// notation from 0.0001 to a million, otherwise with an exponent.
///
/// ```
/// let text = [2.10004, 12_345.678, 1.5e-9, 0.0].map(|x| stretch_data::in_digits(x, 4));
/// assert_eq!(text, ["2.1", "12350", "1.5e-9", "0"]);
/// ```
pub fn in_digits(x: f64, digits: usize) -> String {
    let rounded = significant(x, digits);
    match rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        true => rounded.to_string(),
        false => format!("{rounded:e}"),
    }
}
