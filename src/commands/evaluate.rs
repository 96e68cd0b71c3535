//! `stretch evaluate`: how good a calibration is on trials with a reference.

use std::path::PathBuf;

use stretch_calibrate::{
    Evaluation, MethodErrors, Reach, at_rate, beside_a_constant, evaluate, fitted_on, not_its_own,
    off_throughout, read_calibration, worse_than_the_mean,
};
use stretch_data::Split;
use stretch_report::{comparison_table, method_table};

use super::{
    json::Json,
    reading::{Pace, Recorded, read_trials, with_columns_to_name},
    shared::{say, short_name},
};
use crate::display::warn;
use crate::table::table_text;

/// Judge calibrations on trials that have a reference
///
/// Prints the paper's measures for the raw signal (its extremes scaled onto the
/// reference's) and for each calibration: average error, RMSE, R^2, lag; and
/// paired t tests between them, on samples as the paper did and on means of
/// half-second blocks, which do not count one motion as a thousand.
///
///   stretch evaluate --calibration linear.json --calibration poly13.json walk.csv
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Calibration record; may be given several times
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
    let renamed =
        "a calibration needs the columns that it was fitted on: stretch convert renames columns";
    let trials = read_trials(&args.trials, Split::Test, &columns)
        .map_err(|error| with_columns_to_name(error, renamed))?;
    let named: Vec<_> = calibrations.iter().map(|(name, c)| (name.as_str(), c)).collect();
    let evaluation = evaluate(&named, &trials)?;
    // on standard error, so that a table and JSON are what they were
    for (name, calibration) in &calibrations {
        let paces = trials.iter().filter_map(|trial| {
            // a line and a curve are applied at the trial's own rate
            let mut pace = Pace::of(&at_rate(calibration, trial.rate_hz()?).ok()?);
            let told = trial.time_s.iter().find_map(|&time_s| pace.take(time_s))?;
            Some(format!("{}: {told}", trial.name))
        });
        let doubts = paces.chain(fitted_on(calibration, &trials));
        doubts.for_each(|doubt| warn(format!("stretch: {name}: {doubt}")));
    }
    let own = evaluation.pooled.iter().filter(|errors| errors.method != "raw");
    for (errors, (_, calibration)) in own.zip(&calibrations) {
        let mut reach = Reach::of(calibration);
        let signals =
            trials.iter().filter_map(|trial| trial.channel(calibration.spec().signal.as_str()));
        signals.flatten().for_each(|value| reach.take(*value));
        let outside = reach.doubt().or_else(|| not_its_own(errors.clamped, errors.samples));
        for doubt in [
            outside,
            off_throughout(errors, &evaluation.unit),
            worse_than_the_mean(errors),
            beside_a_constant(errors),
        ]
        .into_iter()
        .flatten()
        {
            warn(format!("stretch: {}: {doubt}", errors.method));
        }
    }
    args.json.answer(&evaluation, || print(&evaluation))
}

/// The paper's table of some trials.
pub(super) fn print_errors(
    title: &str,
    methods: &[MethodErrors],
    unit: &str,
) -> anyhow::Result<()> {
    let names: Vec<String> = methods.iter().map(|errors| errors.method.clone()).collect();
    say(table_text(&method_table(title, methods, &names, unit)))
}

/// The paper's table, a trial each and pooled.
pub(super) fn print(evaluation: &Evaluation) -> anyhow::Result<()> {
    let unit = &evaluation.unit;
    for trial in &evaluation.trials {
        print_errors(&trial.trial, &trial.methods, unit)?;
    }
    if evaluation.trials.len() > 1 {
        print_errors("All trials", &evaluation.pooled, unit)?;
    }
    say(
        "Average error: mean |reference - estimate| over the range of the estimate, as in the paper. Lag: positive when the estimate runs \
         behind. Outside domain: samples that the calibration had to hold at the ends of its range.",
    )?;
    if evaluation.comparisons.is_empty() {
        return Ok(());
    }
    say(table_text(&comparison_table(&evaluation.comparisons, unit, str::to_owned)))
}
