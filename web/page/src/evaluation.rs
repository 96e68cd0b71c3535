//! Evaluation and use of a calibration file, with the same steps as `stretch evaluate` and `stretch apply`.

use serde::Serialize;
use stretch_calibrate::{Doubt, Evaluation, at_rate, evaluate, evaluation_doubts};
use stretch_report::{Table, errors_in_words, method_table};
use stretch_sleeve::{GaugeCalibration, apply_gauge};

use crate::{
    files::Files,
    said::{Said, in_page},
};

/// A table for the page.
#[derive(Debug, Serialize)]
pub(crate) struct Shown {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    best: Option<usize>,
}

impl From<Table> for Shown {
    fn from(Table { head, rows, highlight, .. }: Table) -> Self {
        Self { head, rows, best: highlight }
    }
}

/// Errors of calibrations, and reasons to doubt the calibrations.
#[derive(Debug, Serialize)]
pub(crate) struct Errors {
    sentence: String,
    table: Shown,
    trials: Vec<String>,
    doubts: Vec<String>,
}

impl Errors {
    pub(crate) fn of(sentence: String, evaluation: &Evaluation, doubts: &[Doubt]) -> Self {
        let Evaluation { pooled, trials, unit, .. } = evaluation;
        let names: Vec<String> = pooled.iter().map(|errors| errors.method.clone()).collect();
        Self {
            sentence,
            table: method_table("", pooled, &names, unit).into(),
            trials: trials.iter().map(|trial| trial.trial.clone()).collect(),
            doubts: doubts.iter().map(|doubt| in_page(&doubt.text)).collect(),
        }
    }
}

/// Evaluates the calibration file that was read last.
pub(crate) fn evaluate_record(files: &Files) -> Result<Errors, Said> {
    let (name, gauge) = files.record()?;
    let (named, trials) = ([(name.as_str(), gauge.calibration())], files.evaluated()?);
    let evaluation = evaluate(&named, &trials)?;
    let doubts = evaluation_doubts(&named, &trials, &evaluation);
    let sentence =
        errors_in_words(&evaluation.pooled, &evaluation.unit, |_| format!("Calibration {name}"));
    Ok(Errors::of(sentence.unwrap_or_default(), &evaluation, &doubts))
}

/// Estimates of a recording as CSV, and doubts about them.
#[derive(Debug, Serialize)]
pub(crate) struct Estimates {
    csv: String,
    doubts: Vec<String>,
}

/// Applies the calibration file that was read last to a recording.
pub(crate) fn estimates(files: &Files, name: &str) -> Result<Estimates, Said> {
    let ((_, gauge), trial) = (files.record()?, files.recording(name)?);
    let own_hz = gauge.calibration().spec().sample_rate_hz.hz();
    let calibration = at_rate(gauge.calibration(), trial.rate_hz().unwrap_or(own_hz))?;
    let gauge = GaugeCalibration::new(calibration, gauge.turns().copied())?;
    let applied = apply_gauge(&gauge, trial, false)?.applied;
    let mut csv = Vec::new();
    applied.write_csv(gauge.calibration(), trial, &mut csv)?;
    let (_, doubts) = applied.seen(gauge.calibration(), trial);
    Ok(Estimates {
        csv: String::from_utf8(csv)?,
        doubts: doubts.iter().map(|doubt| in_page(&doubt.text)).collect(),
    })
}
