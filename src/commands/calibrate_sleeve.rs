//! Calibrations of several gauges, and calibrations that update a prior:
//! `stretch calibrate --signal s1,s2` and `--prior`.

use std::path::{Path, PathBuf};

use anyhow::ensure;
use serde::Serialize;
use stretch_calibrate::{CalibrateError, ModelKind, Options, calibrate, copied_signals, evaluate};
use stretch_data::files::{Outputs, is_standard_output};
use stretch_data::{Split, Trial, unit_of};
use stretch_report::{Context, gauges_report};
use stretch_sleeve::{
    Carried, Prior, Session, SleeveCalibration, SleeveError, SleeveFit, SleeveOptions,
    UpdateSummary, calibrate_array, evaluate_arrays,
};

use super::{
    calibrate::{Args, Signal, full_names, other_columns},
    reading::{read_trials, with_columns_to_name},
    shared::{doubt, of_files, say_below, say_first, stage_text, with_unit},
};
use crate::table::{maybe, table};

/// A calibration to one reference, with the data that `--json` prints.
#[derive(Serialize)]
struct Made {
    #[serde(skip)]
    calibration: SleeveCalibration,
    reference: String,
    signals: Vec<String>,
    /// Root mean square error on data that were left out of the fit.
    rmse: Option<f64>,
    carried: Vec<Carried>,
    update: Option<UpdateSummary>,
    notes: Vec<String>,
}

/// The output of `--json`: a list if there are several references.
#[derive(Serialize)]
#[serde(untagged)]
enum Answer<'a> {
    One(&'a Made),
    Several(&'a [Made]),
}

pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let prior = args.prior.as_deref().map(Prior::read).transpose()?;
    let references: Vec<String> = match &prior {
        // The prior's reference is used unless another one is given.
        Some(prior) if args.reference == "length_mm" => vec![prior.reference.clone()],
        _ => args.reference.split(',').map(str::to_owned).collect(),
    };
    ensure!(
        references.len() == 1 || args.session.is_none() && prior.is_none(),
        "--reference {}: --prior and --session work with one reference; name one, and run the command once for each",
        args.reference
    );
    ensure!(
        references.len() == 1 || !is_standard_output(&args.out),
        "--reference {}: each reference gets its own calibration file, and several cannot go to standard output; name a file with --out",
        args.reference
    );
    let named = match (args.signal(), &prior) {
        (_, Some(prior)) if !args.names_signals() => prior.signals.clone(),
        (Signal::One(name), _) => vec![name],
        (Signal::Together(names), _) => names,
        (Signal::Best(_), _) => {
            anyhow::bail!(
                "--signal auto: --prior and --session need the names of the signals, such as --signal s1,s2"
            )
        }
    };
    // The columns that the user names are required here. The update later requires the signals of the prior.
    let asked = references.iter().chain(named.iter().filter(|_| args.names_signals()));
    let columns = asked.fold(args.recorded.options(), |columns, name| columns.require(name));
    let columns = if named.is_empty() { columns.all_columns() } else { columns };
    let trials = read_trials(&args.trials, Split::Fit, &columns);
    let own = "name your columns with --reference and --signal";
    let trials = trials.map_err(|error| with_columns_to_name(error, own))?;
    let (references, named) = (full_names(&trials, &references), full_names(&trials, &named));
    let signals = if named.is_empty() { other_columns(&trials, &references)? } else { named };
    let of_trials = |error: SleeveError| of_files(error, &args.trials);
    let options = |reference: &str| SleeveOptions {
        rest_length: args.rest_length,
        time: args.recorded.stored_time(),
        ..SleeveOptions::new(signals.clone(), reference).of(&args.of)
    };
    let one = |reference: &String| make(prior.as_ref(), &trials, options(reference));
    let made: Result<Vec<Made>, _> = references.iter().map(one).collect();
    let made = made.map_err(of_trials)?;
    copied_signals(&trials, &signals).iter().for_each(doubt);
    let mut outputs = Outputs::default();
    let records: Vec<PathBuf> = match &references[..] {
        [_] => vec![args.out.clone()],
        several => several.iter().map(|name| record_of(&args.out, name)).collect(),
    };
    for (made, path) in made.iter().zip(&records) {
        let record = made.calibration.bytes(path)?;
        outputs.file(path, |out| out.write_all(&record))?;
    }
    let reports = stage_reports(args, &made, &trials, &mut outputs)?;
    if let Some(path) = &args.session {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (session, _) =
            Session::new(&name, &trials, &options(&references[0])).map_err(of_trials)?;
        stage_text(&mut outputs, path, &session.to_json()?)?;
    }
    let answer = match &made[..] {
        [one] => Answer::One(one),
        several => Answer::Several(several),
    };
    args.json.conclude(outputs, &answer, || {
        made.iter().try_for_each(|made| say_first(sentence(made)))?;
        let written = records.iter().chain(&reports).chain(&args.session).map(PathBuf::as_path);
        say_below(made.iter().flat_map(blocks), written)
    })
}

/// Updates a prior by trials, or fits gauges to them.
fn make(
    prior: Option<&Prior>,
    trials: &[Trial],
    options: SleeveOptions,
) -> Result<Made, SleeveError> {
    let (calibration, own, update, notes) = match prior {
        Some(prior) => {
            let SleeveFit { calibration, summary, notes } = prior.update(trials, &options)?;
            (calibration, None, Some(summary), notes)
        }
        None => {
            let SleeveFit { calibration, summary, notes } = calibrate_array(trials, &options)?;
            (calibration, Some(summary), None, notes)
        }
    };
    let (rmse, carried) = own.map_or((None, Vec::new()), |own| (Some(own.rmse), own.carried));
    let SleeveOptions { reference, signals, .. } = options;
    Ok(Made { calibration, reference, signals, rmse, carried, update, notes })
}

/// Adds the report of each calibration to the outputs, and returns their paths.
fn stage_reports(
    args: &Args,
    made: &[Made],
    trials: &[Trial],
    outputs: &mut Outputs,
) -> anyhow::Result<Vec<PathBuf>> {
    let Some(path) = &args.report else { return Ok(Vec::new()) };
    let path_of = |one: &Made| match made {
        [_] => path.clone(),
        _ => record_of(path, &one.reference),
    };
    let stage = |one: &Made| {
        let page = report(one, trials, args.rest_length);
        let (page, path) = (page.map_err(|error| of_files(error, &args.trials))?, path_of(one));
        stage_text(outputs, &path, &page)?;
        Ok(path)
    };
    made.iter().map(stage).collect()
}

/// Returns the report of a calibration: a section for all gauges together, and one for a straight line through the
/// signal of each gauge. A gauge to which no line can be fitted has no section.
fn report(
    made: &Made,
    trials: &[Trial],
    rest_length: Option<f64>,
) -> Result<String, CalibrateError> {
    let together = match &made.calibration {
        SleeveCalibration::One(one) => evaluate(&[("together", one.calibration())], trials)?,
        SleeveCalibration::Many(many) => evaluate_arrays(&[("together", &**many)], trials)?,
    };
    let line = |signal: &String| {
        let (signal, reference) = (signal.clone(), made.reference.clone());
        let model = ModelKind::Linear;
        let options = Options { signal, reference, model, rest_length, ..Options::default() };
        let line = calibrate(trials, &options).ok()?;
        let evaluation = evaluate(&[("linear", &line.calibration)], trials).ok()?;
        Some((options.signal, line, evaluation))
    };
    let lines: Vec<_> = made.signals.iter().filter_map(line).collect();
    let gauges: Vec<_> =
        lines.iter().map(|(signal, line, judged)| (signal.as_str(), line, judged)).collect();
    let context = Context {
        title: format!("Calibration of {} on {}", made.reference, made.signals.join(", ")),
        calibrated_on: trials.iter().map(|trial| trial.name.clone()).collect(),
        notes: made.notes.clone(),
        ..Context::default()
    };
    Ok(gauges_report(&together, &gauges, &context))
}

/// Returns the path for the calibration file or the report of one of several references: wrist.json becomes
/// wrist.bend_deg.json.
fn record_of(out: &Path, reference: &str) -> PathBuf {
    match out.extension() {
        Some(ending) => out.with_extension(format!("{reference}.{}", ending.to_string_lossy())),
        None => out.with_extension(reference),
    }
}

/// Returns the error of a calibration as a sentence.
fn sentence(made: &Made) -> String {
    let unit = unit_of(&made.reference);
    let what = format!("The calibration of {} on {}", made.reference, made.signals.join(", "));
    match (made.rmse, &made.update) {
        (Some(rmse), _) => {
            let off = with_unit(rmse, &unit);
            format!("{what} is off by {off} (RMSE) on parts of the trials that were not fitted.")
        }
        (None, Some(update)) => {
            let what =
                format!("{what} comes from the prior and {:.1} s of reference", update.seconds);
            match (update.expected_rmse, update.half_width_95) {
                (Some(rmse), Some(half_width)) => format!(
                    "{what}. Earlier sessions with as much reference were off by {} (RMSE) on movements that were left out, and 95 % of their errors \
                     were within {}.",
                    with_unit(rmse, &unit),
                    with_unit(half_width, &unit)
                ),
                _ => format!(
                    "{what}. Its error cannot be estimated, because no session of the prior can be left out for this."
                ),
            }
        }
        (None, None) => format!("{what} was fitted."),
    }
}

/// Returns a table with the errors of each channel alone and of the calibration without it, and the notes.
fn blocks(made: &Made) -> Vec<String> {
    let mut blocks = Vec::new();
    if made.rmse.is_some() {
        let alone = format!("alone, RMSE {}", unit_of(&made.reference));
        let channel = format!("channel for {}", made.reference);
        let header = [channel.as_str(), alone.trim_end(), "without it", "reduces MSE by"];
        let row = |c: &Carried| {
            let adds = c.adds.map_or("-".to_owned(), |adds| format!("{:.0} %", 100.0 * adds));
            vec![c.signal.clone(), maybe(c.rmse_alone), maybe(c.rmse_without), adds]
        };
        blocks.push(table(&header, made.carried.iter().map(row)));
    }
    blocks.extend(made.notes.iter().map(|note| format!("note: {note}")));
    blocks
}
