//! The time of a recording: which column it is, what it counts, and whether anybody records like that.

use stretch_data::Trial;

use crate::{ReadOptions, RecordingError, names::time_rank, options::TIME, stamps::date};

/// Rates that are recorded, Hz: below a sample in a quarter of an hour and above a converter's ten million nobody does.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1e-3..=1e7;
/// Seconds since 1970 in any recording; no recorder runs for three years.
pub(crate) const EPOCH_S: f64 = 1e8;
/// Fewest samples that tell whole numbers from chance.
const TELLING: usize = 50;

/// Where the time stands among names: under the name asked for, or, where nobody asked, under one that elsewhere is usual.
pub(crate) fn time_among(names: &[String], options: &ReadOptions) -> Option<usize> {
    let wanted = &options.time;
    let usual = || {
        let ranked = names.iter().enumerate().filter_map(|(i, name)| Some((time_rank(name)?, i)));
        ranked.min().map(|(_, i)| i)
    };
    names
        .iter()
        .position(|name| name == wanted)
        .or_else(|| if wanted == TIME { usual() } else { None })
}

/// A note on a time that counts from long ago, or is a time of day, and is counted from its first sample instead.
pub(crate) fn told_epoch(first_s: f64) -> String {
    if first_s.abs() < EPOCH_S {
        return "time counts from the first sample".to_owned();
    }
    format!("time counts from the first sample, {}", date(first_s))
}

/// Refuses a recording whose time cannot be what it says.
pub(crate) fn check(
    trial: &Trial,
    column: &str,
    options: &ReadOptions,
) -> Result<(), RecordingError> {
    let (Some(rate_hz), true) = (trial.rate_hz(), trial.len() > 2) else { return Ok(()) };
    let (file, column) = (trial.name.clone(), column.to_owned());
    if !RATES_HZ.contains(&rate_hz) {
        return Err(RecordingError::Rate { file, column, rate_hz });
    }
    let says_so = options.time_unit.is_some() || options.sample_rate_hz.is_some();
    let is_whole = || trial.time_s.iter().all(|t| t.fract() == 0.0);
    if !says_so && rate_hz <= 1.0 && trial.len() >= TELLING && is_whole() {
        let base = column.strip_suffix("_s").unwrap_or(&column);
        let column_ms = format!("{base}_ms");
        return Err(RecordingError::WholeSeconds {
            file,
            column,
            step: 1.0 / rate_hz,
            rate_hz,
            column_ms,
        });
    }
    Ok(())
}
