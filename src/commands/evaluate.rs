//! `stretch evaluate`: measures the errors of a calibration on trials with a reference.

use std::path::PathBuf;

use stretch_calibrate::{
    Evaluation, MethodErrors, TrialErrors, evaluate, evaluation_doubts, read_calibration,
};
use stretch_data::Split;
use stretch_report::{comparison_table, errors_in_words, method_table};

use super::{
    json::Json,
    reading::{Recorded, read_trials, with_columns_to_name},
    shared::{say_below, say_first, short_name},
};
use crate::display::{is_verbose, warn};
use crate::table::table_text;

/// Evaluate calibrations on trials that have a reference
///
/// Prints the paper's measures for the raw signal (scaled so that its extremes match
/// those of the reference) and for each calibration: average error, RMSE, R^2, lag.
/// Paired t tests compare them, on samples as in the paper, and on means of half-second
/// blocks because the samples of one motion are not independent.
///
///   stretch evaluate --calibration linear.json --calibration poly13.json walk.csv
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Calibration file; can be repeated
    #[arg(long, required = true, value_name = "cal.json")]
    calibration: Vec<PathBuf>,
    /// Trials, or a folder with a dataset.toml for its test trials
    #[arg(required = true, value_name = "TRIAL.csv")]
    trials: Vec<PathBuf>,
    #[command(flatten)]
    recorded: Recorded,
    #[command(flatten)]
    json: Json,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let mut calibrations = Vec::new();
    for path in &args.calibration {
        calibrations.push((short_name(path), read_calibration(path)?));
    }
    let mut columns = args.recorded.options();
    if let Some((_, first)) = calibrations.first() {
        columns = columns.untimed_hz(first.spec().sample_rate_hz.hz());
    }
    for (_, calibration) in &calibrations {
        columns = columns.require(calibration.spec().signal.as_str());
        columns = columns.require(calibration.spec().reference.as_str());
    }
    let renamed = "a calibration needs the columns that it was fitted to: rename them, and convert their units, with stretch convert --column NEW=OLD*FACTOR";
    let trials = read_trials(&args.trials, Split::Test, &columns)
        .map_err(|error| with_columns_to_name(error, renamed))?;
    let named: Vec<_> = calibrations.iter().map(|(name, c)| (name.as_str(), c)).collect();
    let evaluation = evaluate(&named, &trials)?;
    // Printed on standard error, so that the output on standard output is unchanged.
    for doubt in evaluation_doubts(&named, &trials, &evaluation) {
        warn(format!("stretch: {doubt}"));
    }
    args.json.answer(&evaluation, || print(&evaluation))
}

/// Formats the errors on some trials as the table of the published method ("the paper").
pub(super) fn table_of_errors(title: &str, methods: &[MethodErrors], unit: &str) -> String {
    let names: Vec<String> = methods.iter().map(|errors| errors.method.clone()).collect();
    table_text(&method_table(title, methods, &names, unit))
}

/// Prints the error as a sentence and the table of all trials. With `-v`, also prints a table for
/// each trial, and tests whether the methods differ.
fn print(evaluation: &Evaluation) -> anyhow::Result<()> {
    let Evaluation { unit, trials, pooled, comparisons } = evaluation;
    let name = |i: usize| pooled[i].method.clone();
    if let Some(errors) = errors_in_words(pooled, unit, name) {
        say_first(errors)?;
    }
    let mut blocks = Vec::new();
    if is_verbose() && trials.len() > 1 {
        let each = |trial: &TrialErrors| table_of_errors(&trial.trial, &trial.methods, unit);
        blocks.extend(trials.iter().map(each));
    }
    let title = match &trials[..] {
        [one] => one.trial.as_str(),
        _ => "All trials",
    };
    blocks.push(table_of_errors(title, pooled, unit));
    if is_verbose() {
        blocks.push(
            "Average error: mean |reference - estimate| over the range of the estimate, as in the paper. Bias: mean of estimate minus \
             reference. Lag: positive if the estimate is late. Outside domain: samples whose signal or rate of change was clamped to the \
             calibrated range."
                .to_owned(),
        );
        if !comparisons.is_empty() {
            blocks.push(table_text(&comparison_table(comparisons, unit, str::to_owned)));
        }
    }
    say_below(blocks, std::iter::empty())
}
