//! The measured trials of a gauge alone: two columns, evenly sampled, and notes on the trials.

use stretch_calibrate::PRESSURE;
use stretch_data::{SessionTrial, unit};
use stretch_gap::Noise;

use crate::{
    bench::{columns::Columns, shortened::shortened},
    error::{ProblemError, check_rate},
};

/// Index of the reference among the columns.
pub(super) const REFERENCE: usize = 0;
/// Index of the signal.
pub(super) const SIGNAL: usize = 1;
/// Index of the pressure, which is a column if every trial has one.
const PRESSED: usize = 2;

/// Smallest number of samples to fit.
const LEAST: usize = 300;
/// Parts of a trial with fewer samples are left out.
const SHORTEST: usize = 100;

/// Reads two columns of some trials, and the pressure if every trial has one.
///
/// # Errors
/// Columns that are missing, dead or hold values that are not numbers, rates that differ, too
/// little to fit.
pub(super) fn read(
    trials: &[SessionTrial],
    reference: &str,
    signal: &str,
) -> Result<Columns, ProblemError> {
    let (trials, cut) = shortened(trials, 1)?;
    let mut names = vec![reference.to_owned(), signal.to_owned()];
    if trials.iter().all(|t| t.trial.channel(PRESSURE).is_some()) {
        names.push(PRESSURE.to_owned());
    }
    let mut columns = Columns::even(&trials, names, SHORTEST)?;
    check_rate(columns.dt_s)?;
    columns.notes.splice(0..0, cut);
    columns.mark_undetermined(false);
    let notes = checked(&columns)?;
    columns.notes.extend(notes);
    Ok(columns)
}

/// The pressure; none unless every trial has one.
pub(super) fn pressure(columns: &Columns) -> &[f64] {
    columns.values.get(PRESSED).map_or(&[], Vec::as_slice)
}

/// Noise of values from the median of their second differences in the trials that are fitted.
pub(super) fn noise(columns: &Columns, values: &[f64]) -> Noise {
    Noise::of_differences(columns.looked_at().into_iter().map(|r| &values[r]), columns.dt_s)
}

/// Checks reference and signal, and returns notes on them.
fn checked(columns: &Columns) -> Result<Vec<String>, ProblemError> {
    let both = || columns.names.iter().zip(&columns.values).take(PRESSED);
    let (reference, signal) = (&columns.names[REFERENCE], &columns.names[SIGNAL]);
    let samples: usize = columns.fitted().map(|r| r.len()).sum();
    if samples < LEAST {
        return Err(ProblemError::few_samples(samples, LEAST));
    }
    if reference == "bridge_v" || signal == "length_mm" {
        let column = format!("--reference {reference}, --signal {signal}");
        let hint =
            "exchange them: the reference is the length, the signal is the output of the gauge";
        return Err(ProblemError::value(column, "the two look swapped", hint));
    }
    let mut shares = Vec::new();
    for (name, values) in both() {
        let (low, high) = columns.range(values);
        if high <= low {
            return Err(ProblemError::dead(name.as_str(), format!("{low} in every sample")));
        }
        shares.push(noise(columns, values).sd() / (high - low));
    }
    let mut notes = Vec::new();
    if shares[0] > 3.0 * shares[1] {
        notes.push(format!(
            "{reference} is noisier than {signal}, each compared with its own range: are reference and signal swapped?"
        ));
    }
    for (name, values) in both() {
        let (low, high) = columns.range(values);
        if unit(name) == Some("mm") && high.abs().max(low.abs()) < 1.0 {
            notes.push(format!(
                "{name} goes from {low} to {high}: this looks like metres; the verdict does not depend on it"
            ));
        }
        for (end, which) in [(low, "least"), (high, "greatest")] {
            let share = standing(columns, values, end);
            if share > 0.01 {
                notes.push(format!(
                    "{name} is at its {which} value, {end}, in {:.1} % of the samples: if this is a limit of its converter, all \
                     values beyond it are lost",
                    100.0 * share
                ));
            }
        }
    }
    Ok(notes)
}

/// Share of the samples that have the value `end`, in sequences of at least five such samples.
fn standing(columns: &Columns, values: &[f64], end: f64) -> f64 {
    let (mut count, mut all) = (0, 0);
    for range in columns.fitted() {
        all += range.len();
        let rows = values[range].chunk_by(|a, b| (*a == end) == (*b == end));
        count += rows.filter(|r| r[0] == end && r.len() >= 5).map(<[f64]>::len).sum::<usize>();
    }
    count as f64 / all.max(1) as f64
}
