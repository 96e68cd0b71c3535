//! Unit of a time column, from an option, the format, the name of the column, or its values.

use std::ops::RangeInclusive;

use crate::{
    ReadOptions, RecordingError, TimeUnit,
    clock::{Stamps, Steps},
};

/// Accepted sample rates, Hz, if an option gives the unit or the rate.
pub(crate) const RATES_HZ: RangeInclusive<f64> = 1e-3..=1e7;
/// Accepted sample rates, Hz, if no option gives the unit or the rate. A stretch sensor is not sampled at megahertz.
const USUAL_HZ: RangeInclusive<f64> = 1e-3..=1e6;
/// Sample rates of nearly all recordings, Hz.
const LIKELY_HZ: RangeInclusive<f64> = 0.5..=5e3;
/// Seconds since 1970, from 1989 to 2103.
const SINCE_1970_S: RangeInclusive<f64> = 6e8..=4.2e9;
/// Day numbers of spreadsheets (for the years 1954 to 2119) and of MATLAB, and Julian days.
const DAYS: [RangeInclusive<f64>; 3] = [2e4..=8e4, 7e5..=7.8e5, 2.43e6..=2.5e6];
/// Sample rate, Hz, above which a time that was taken for seconds may be in days.
const DAYS_HZ: f64 = 1e4;
/// Smallest number of samples for which a rate of at most 1 Hz is reported as an ambiguous unit.
const TELLING: usize = 50;

/// Ratio of the rate of one step to the expected rate if the unit is right. The range is wide because stamps have
/// jitter.
const NEAR: RangeInclusive<f64> = 0.25..=4.0;

/// Units in which time since 1970 is counted.
const EPOCHS: [TimeUnit; 4] =
    [TimeUnit::Seconds, TimeUnit::Milliseconds, TimeUnit::Microseconds, TimeUnit::Nanoseconds];

/// Returns the counts per second of a time column.
///
/// # Errors
/// Seconds and milliseconds are both plausible.
pub(super) fn decide(
    file: &str,
    stamps: &Stamps,
    steps: Steps,
    options: &ReadOptions,
    notes: &mut Vec<String>,
) -> Result<f64, RecordingError> {
    if let Some(known) =
        stamps.per_second.or(options.unit_of(Some(&stamps.name)).map(TimeUnit::per_second))
    {
        return Ok(known);
    }
    let named = TimeUnit::of(&stamps.name);
    let unit = named.unwrap_or(TimeUnit::Seconds);
    if let Some(other) = by_values(stamps, steps, named) {
        notes.push(format!(
            "column {} is taken to be in {}, because of its values",
            stamps.name,
            other.plural()
        ));
        return Ok(other.per_second());
    }
    let rate_hz = unit.per_second() / steps.sample;
    let is_whole = || stamps.counts.iter().all(|t| t.fract() == 0.0);
    let is_slow = unit == TimeUnit::Seconds && rate_hz <= 1.0 && stamps.counts.len() >= TELLING;
    if is_slow && USUAL_HZ.contains(&rate_hz) && (named.is_none() || is_whole()) {
        let column = &stamps.name;
        let column_ms = format!("{}_ms", column.strip_suffix("_s").unwrap_or(column));
        let (step, rate_hz_if_ms) = (steps.sample, 1e3 * rate_hz);
        let problem = format!(
            "its times go up by {step} from sample to sample: that is {rate_hz} samples a second if they are seconds and {rate_hz_if_ms} if they are milliseconds; say which with --time {column}:s or {column}:ms, or rename it {column_ms}"
        );
        return Err(RecordingError::unusable(format!("{file}, column {column}"), problem));
    }
    Ok(unit.per_second())
}

/// Returns the unit that follows from the values, if it differs from the unit in the name (seconds if the name has no
/// unit).
fn by_values(stamps: &Stamps, steps: Steps, named: Option<TimeUnit>) -> Option<TimeUnit> {
    let value = stamps.recorded(stamps.counts.len() / 2);
    let rate_hz = |unit: TimeUnit| unit.per_second() / steps.sample;
    let own = named.unwrap_or(TimeUnit::Seconds);
    let other = if let Some(epoch) = epoch(value).filter(|unit| USUAL_HZ.contains(&rate_hz(*unit)))
        // The values override the unit in a name only if this unit would give a date that no recording has.
        && (named.is_none() || value / own.per_second() > *SINCE_1970_S.end())
    {
        Some(epoch)
    } else if own == TimeUnit::Seconds && rate_hz(own) > DAYS_HZ && are_days(value) {
        Some(TimeUnit::Days).filter(|days| USUAL_HZ.contains(&rate_hz(*days)))
    } else if named.is_none() && rate_hz(own) < *USUAL_HZ.start() {
        let mut likely = EPOCHS.into_iter().filter(|unit| LIKELY_HZ.contains(&rate_hz(*unit)));
        likely.next().filter(|_| likely.next().is_none())
    } else {
        None
    };
    other.filter(|other| *other != own)
}

/// Returns the unit in which a step agrees with the expected rate, if the step does not agree with it in seconds.
pub(super) fn by_step(step: f64, usual_hz: f64) -> Option<TimeUnit> {
    let is_near = |unit: TimeUnit| NEAR.contains(&(unit.per_second() / step / usual_hz));
    let others = [
        TimeUnit::Milliseconds,
        TimeUnit::Microseconds,
        TimeUnit::Nanoseconds,
        TimeUnit::Minutes,
        TimeUnit::Days,
    ];
    others.into_iter().find(|unit| is_near(*unit)).filter(|_| !is_near(TimeUnit::Seconds))
}

/// Returns the unit in which a number is a plausible time since 1970.
pub(super) fn epoch(value: f64) -> Option<TimeUnit> {
    EPOCHS.into_iter().find(|unit| SINCE_1970_S.contains(&(value / unit.per_second())))
}

fn are_days(value: f64) -> bool {
    DAYS.iter().any(|days| days.contains(&value))
}

/// Refuses an implausible sample rate.
pub(super) fn check_rate(
    file: &str,
    stamps: &Stamps,
    steps: Steps,
    options: &ReadOptions,
) -> Result<(), RecordingError> {
    let Some(per_second) = stamps.per_second.filter(|_| stamps.counts.len() > 2) else {
        return Ok(());
    };
    let rate_hz = per_second / steps.sample;
    let is_said = options.unit_of(Some(&stamps.name)).is_some() || options.sample_rate_hz.is_some();
    let usual = if is_said { RATES_HZ } else { USUAL_HZ };
    check_range(file, &stamps.name, rate_hz, usual)
}

/// Refuses a rate outside a range.
pub(crate) fn check_range(
    file: &str,
    column: &str,
    rate_hz: f64,
    range: RangeInclusive<f64>,
) -> Result<(), RecordingError> {
    if range.contains(&rate_hz) {
        return Ok(());
    }
    let problem = format!(
        "its time stamps give {rate_hz:.3e} samples per second, which is not between {:e} and {:e}; give their unit with --time {column}:s, :ms, \
         :us, :ns, :min, :h or :d, or replace them by a rate with --time RATEhz",
        range.start(),
        range.end()
    );
    Err(RecordingError::unusable(format!("{file}, column {column}"), problem))
}
