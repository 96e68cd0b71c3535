//! The measured trials of a gauge alone: two columns, evenly sampled, and notes on the trials.

use stretch_calibrate::PRESSURE;
use stretch_data::{SessionTrial, unit};
use stretch_gap::Noise;

use crate::{
    bench::{columns::Columns, rails::leave_out_rails},
    error::ProblemError,
};

/// Index of the reference among the columns.
pub(super) const REFERENCE: usize = 0;
/// Index of the signal.
pub(super) const SIGNAL: usize = 1;
/// Index of the pressure, which is a column if every trial has one.
const PRESSED: usize = 2;

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
    let mut names = vec![reference.to_owned(), signal.to_owned()];
    if trials.iter().all(|t| t.trial.channel(PRESSURE).is_some()) {
        names.push(PRESSURE.to_owned());
    }
    let mut columns = Columns::built_in(trials, names, &[reference, signal], 1, false)?;
    check(&mut columns)?;
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

/// Checks reference and signal, and adds notes and doubts about them.
fn check(columns: &mut Columns) -> Result<(), ProblemError> {
    let both = || columns.names.iter().zip(&columns.values).take(PRESSED);
    let (reference, signal) = (&columns.names[REFERENCE], &columns.names[SIGNAL]);
    if reference == "bridge_v" || signal == "length_mm" {
        let column = format!("--reference {reference}, --signal {signal}");
        let hint =
            "exchange them: the reference is the length, the signal is the output of the gauge";
        return Err(ProblemError::value(column, "the two look swapped", hint));
    }
    let (mut shares, mut noises) = (Vec::new(), Vec::new());
    let (mut notes, mut doubts) = (Vec::new(), Vec::new());
    for (name, values) in both() {
        let (low, high) = columns.range(values);
        if high <= low {
            return Err(ProblemError::dead(name.as_str(), format!("{low} in every sample")));
        }
        let sd = noise(columns, values).sd();
        shares.push(sd / (high - low));
        noises.push((name.clone(), sd));
    }
    if shares[0] > 3.0 * shares[1] {
        doubts.push(format!(
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
    }
    columns.notes.extend(notes);
    noises.iter().for_each(|(name, sd)| leave_out_rails(columns, name, *sd));
    columns.doubts.extend(doubts);
    Ok(())
}
