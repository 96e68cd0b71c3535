//! The sample rate that the lines above a table state.

use stretch_data::snake_case;

use crate::{TimeUnit, names::unit, text::dialect::cells};

/// Names of a field with the sample interval.
const INTERVALS: [&str; 9] = [
    "increment",
    "interval",
    "sample_interval",
    "sampling_interval",
    "sample_period",
    "delta_x",
    "x_increment",
    "tinc",
    "dt",
];
/// Names of a field with the sample rate.
const RATES: [&str; 6] =
    ["sample_rate", "sampling_rate", "sample_frequency", "sampling_frequency", "samplerate", "fs"];

/// Returns the stated sample rate and the name of its field. The value is in the same cell as the name, in the next
/// cell, or in the cell below.
pub(crate) fn stated_rate_hz(lines: &[&[u8]], delimiter: u8) -> Option<(f64, String)> {
    let split = |line: &[u8]| -> Vec<String> {
        let cells = cells(line, delimiter).unwrap_or_default();
        cells.iter().map(|cell| String::from_utf8_lossy(cell).into_owned()).collect()
    };
    let rows: Vec<Vec<String>> = lines.iter().map(|line| split(line)).collect();
    let stated = |(row, column): (usize, usize)| {
        let cell = &rows[row][column];
        let (key, value) = cell.split_once(['=', ':']).unwrap_or((cell, ""));
        let below = rows.get(row + 1).and_then(|row| row.get(column));
        let values = [Some(value), rows[row].get(column + 1).map(String::as_str)];
        let values = values.into_iter().chain([below.map(String::as_str)]).flatten();
        let rate_hz = values.filter(|value| !value.is_empty()).find_map(|v| rate_of(key, v));
        Some((rate_hz?, key.trim().to_owned()))
    };
    let places = (0..rows.len()).flat_map(|row| (0..rows[row].len()).map(move |cell| (row, cell)));
    places.filter_map(stated).next()
}

/// Returns the sample rate from a field; `None` unless the name means a rate or an interval and the value is a number,
/// with or without a unit.
fn rate_of(key: &str, value: &str) -> Option<f64> {
    let (key, of_key) = match key.trim().strip_suffix([')', ']']) {
        Some(key) => key.split_once(['(', '['])?,
        None => (key, ""),
    };
    let key = snake_case(key);
    let value = value.trim().replace(',', ".");
    let (number, length) = fast_float2::parse_partial::<f64, _>(&value).ok()?;
    let of_value = value.get(length..)?.trim();
    let scale = match unit(if of_value.is_empty() { of_key } else { of_value })?.as_str() {
        "" | "hz" => 1.0,
        "khz" => 1e3,
        time => 1.0 / TimeUnit::abbreviated(time)?.per_second(),
    };
    let rate_hz = if INTERVALS.contains(&&*key) {
        1.0 / (number * scale)
    } else if RATES.contains(&&*key) {
        number * scale
    } else {
        return None;
    };
    rate_hz.is_finite().then_some(rate_hz).filter(|hz| *hz > 0.0)
}
