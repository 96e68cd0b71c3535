//! `stretch evaluate`: measures the errors of a calibration on trials with a reference.

use std::{fmt::Display, ops::Range, path::PathBuf};

use anyhow::ensure;
use stretch_calibrate::{
    Doubt, Evaluation, MethodErrors, TrialErrors, evaluate, evaluation_doubts, fitted_trials,
    outside_range,
};
use stretch_data::{Split, Trial};
use stretch_report::{comparison_table, errors_in_words, method_table};
use stretch_sleeve::{
    ArrayCalibration, ArraySpec, MAX_CHANNELS, SleeveCalibration, apply_array, evaluate_arrays,
};

use super::{
    apply_several::{require_gauges, warnings},
    json::Json,
    reading::{Recorded, read_trials, with_columns_to_name},
    shared::{say_below, say_first, short_name, with_unit},
};
use crate::display::{doubt, is_verbose};
use crate::table::table_text;

/// Evaluate calibrations on trials that have a reference
///
/// Prints the measures of the published method ("the paper") for the raw signal
/// (scaled so that its extremes match those of the reference) and for each
/// calibration: average error, RMSE, R^2, lag. For a calibration of several gauges, it
/// also prints them for each gauge alone, in place of the raw signal.
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
    let (mut one, mut several) = (Vec::new(), Vec::new());
    for path in &args.calibration {
        match SleeveCalibration::read(path)? {
            SleeveCalibration::One(gauge) => {
                one.push((short_name(path), gauge.calibration().clone()))
            }
            SleeveCalibration::Many(many) => several.push((short_name(path), many)),
        }
    }
    ensure!(
        one.is_empty() || several.is_empty(),
        "--calibration: {} is a calibration of several gauges, and {} is not: evaluate them in two runs",
        several[0].0,
        one[0].0
    );
    let made_on = one.iter().map(|(_, own)| &own.spec().provenance);
    let made_on = made_on.chain(several.iter().map(|(_, own)| &own.spec().provenance)).next();
    let recorded = &args.recorded;
    let mut columns = made_on.map_or_else(|| recorded.options(), |made| recorded.options_of(made));
    let rates = one.iter().map(|(_, own)| own.spec().sample_rate_hz);
    if let Some(rate) = rates.chain(several.iter().map(|(_, own)| own.spec().sample_rate_hz)).next()
    {
        columns = columns.untimed_hz(rate.hz());
    }
    for (_, calibration) in &one {
        columns = columns.require(calibration.spec().signal.as_str());
        columns = columns.require(calibration.spec().reference.as_str());
    }
    for (_, calibration) in &several {
        columns = columns.require(calibration.spec().reference.as_str());
        columns = require_gauges(columns, calibration);
    }
    let renamed = "a calibration needs the columns that it was fitted to: rename them, and convert their units, with stretch convert --column NEW=OLD*FACTOR";
    let trials = read_trials(&args.trials, Split::Test, &columns)
        .map_err(|error| with_columns_to_name(error, renamed))?;
    // Doubts are printed on standard error, so that the output on standard output is unchanged.
    let tell = |found: &dyn Display| doubt(found);
    if several.is_empty() {
        let named: Vec<_> = one.iter().map(|(name, c)| (name.as_str(), c)).collect();
        let evaluation = evaluate(&named, &trials)?;
        evaluation_doubts(&named, &trials, &evaluation).iter().for_each(|doubt| tell(doubt));
        return args.json.answer(&evaluation, || print(&evaluation, 1..named.len() + 1));
    }
    let named: Vec<_> = several.iter().map(|(name, c)| (name.as_str(), &**c)).collect();
    let evaluation = evaluate_arrays(&named, &trials)?;
    for (name, calibration) in &named {
        for trial in &trials {
            let applied = apply_array(calibration, trial)?;
            warnings(calibration, trial, &applied)
                .for_each(|text| tell(&format!("calibration {name}: {text}")));
        }
    }
    array_doubts(&named, &trials, &evaluation).iter().for_each(|doubt| tell(doubt));
    args.json.answer(&evaluation, || print(&evaluation, 0..named.len()))
}

/// Returns the columns of the gauges of a calibration, and of its reference.
fn columns_of(calibration: &ArrayCalibration<MAX_CHANNELS>) -> impl Iterator<Item = &str> {
    let ArraySpec { channels, reference, .. } = calibration.spec();
    channels.iter().map(|channel| channel.signal.as_str()).chain([reference.as_str()])
}

/// Code of the doubt about a shifted estimate.
const SHIFTED: &str = "constant_error";

/// Returns doubts about calibrations of several gauges, and about each gauge alone.
fn array_doubts(
    calibrations: &[(&str, &ArrayCalibration<MAX_CHANNELS>)],
    trials: &[Trial],
    evaluation: &Evaluation,
) -> Vec<Doubt> {
    let mut all = Vec::new();
    for (name, calibration) in calibrations {
        let spec = calibration.spec();
        let columns: Vec<&str> = columns_of(calibration).collect();
        let fitted = fitted_trials(&spec.provenance, &columns, trials);
        all.extend(fitted.map(|doubt| doubt.of(&format!("calibration {name}"))));
    }
    let specs = || calibrations.iter().map(|(_, own)| own.spec());
    for (method, spec) in specs().enumerate() {
        let errors = &evaluation.pooled[method];
        let outside = outside_range(errors.clamped, errors.samples);
        let doubts = Doubt::of_method(evaluation, method, spec.all.sd, spec.reference.as_str());
        all.extend(doubts.into_iter().chain(outside).map(|doubt| doubt.of(&errors.method)));
    }
    // If the estimate from all gauges is not shifted, the shift of a single gauge is not reported, because too few data
    // may have been available to calibrate this gauge alone.
    if !all.iter().any(|doubt| doubt.code == SHIFTED) {
        return all;
    }
    let alone = specs().flat_map(|spec| spec.alone.iter().map(move |gains| (spec, gains.sd)));
    let shifted = (calibrations.len()..).zip(alone).filter(|(method, (spec, sd))| {
        let doubts = Doubt::of_method(evaluation, *method, *sd, spec.reference.as_str());
        doubts.iter().any(|doubt| doubt.code == SHIFTED)
    });
    let shifted = shifted.filter_map(|(method, _)| {
        let errors = evaluation.trials.iter().map(|trial| &trial.methods[method]);
        let worst = errors.max_by(|a, b| a.bias.abs().total_cmp(&b.bias.abs()))?;
        Some(format!("{} {}", worst.method, with_unit(worst.bias, &evaluation.unit)))
    });
    let shifted: Vec<String> = shifted.collect();
    if !shifted.is_empty() {
        let alone = format!("; the estimates of single gauges are off by: {}", shifted.join(", "));
        all.iter_mut().filter(|doubt| doubt.code == SHIFTED).for_each(|doubt| doubt.text += &alone);
    }
    all
}

/// Formats the errors on some trials as the table of the published method ("the paper").
pub(super) fn table_of_errors(title: &str, methods: &[MethodErrors], unit: &str) -> String {
    let names: Vec<String> = methods.iter().map(|errors| errors.method.clone()).collect();
    table_text(&method_table(title, methods, &names, unit))
}

/// Largest number of methods that are shown without `-v`.
const MOST_SHOWN: usize = 9;

/// Prints the error of the best of the compared methods as a sentence, and the table of all trials. `compared` is the
/// range of the calibrations: the raw signal comes before it, the single gauges of a sleeve after it. With `-v`, also
/// prints a table for each trial, and tests whether the methods differ.
fn print(evaluation: &Evaluation, compared: Range<usize>) -> anyhow::Result<()> {
    let Evaluation { unit, trials, pooled, comparisons } = evaluation;
    let name = |i: usize| match (compared.len(), &pooled[i].method) {
        (0 | 1, method) => format!("Calibration {method}"),
        (count, method) => format!("Calibration {method}, the best of {count},"),
    };
    if let Some(errors) = errors_in_words(&pooled[..compared.end], unit, name) {
        say_first(errors)?;
    }
    let mut blocks = Vec::new();
    if is_verbose() && trials.len() > 1 {
        let each = |trial: &TrialErrors| table_of_errors(&trial.trial, &trial.methods, unit);
        blocks.extend(trials.iter().map(each));
    }
    let mut title = match &trials[..] {
        [one] => one.trial.clone(),
        _ => "All trials".to_owned(),
    };
    let mut shown = pooled.clone();
    if !is_verbose() && pooled.len() > MOST_SHOWN {
        shown[compared].sort_by(|a, b| a.rmse.total_cmp(&b.rmse));
        shown.truncate(MOST_SHOWN);
        title = format!("{title} ({MOST_SHOWN} of {} rows)", pooled.len());
    }
    blocks.push(table_of_errors(&title, &shown, unit));
    if is_verbose() {
        blocks.push(
            "Average error: mean |reference - estimate| over the range of the estimate, as in the paper. Bias: mean of estimate minus \
             reference. Lag: positive if the estimate is late. Outside domain: samples whose signal was outside the range of the \
             fitted trials, or whose rate of change was clamped."
                .to_owned(),
        );
        if !comparisons.is_empty() {
            blocks.push(table_text(&comparison_table(comparisons, unit, str::to_owned)));
        }
    }
    say_below(blocks, std::iter::empty())
}
