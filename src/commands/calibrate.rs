//! `stretch calibrate`: fits a calibration to logged trials and writes a calibration file.

use std::{
    convert::Infallible,
    path::{Path, PathBuf},
    str::FromStr,
};

use anyhow::{Context as _, anyhow, bail, ensure};
use clap::ValueEnum;
use serde::Deserialize;
use stretch_calibrate::{
    CalibrateError, Calibrated, Candidate, Evaluation, Memory, ModelChoice, ModelKind, Options,
    Robust, SpellingError, calibrate, choose_model_watched, copied_signals, evaluate_errors,
    explains_little, explains_nothing, parse_rate, rank_signals, without_clipped,
    without_gross_errors,
};
use stretch_core::RateEstimator;
use stretch_data::files::{Outputs, read_whole};
use stretch_data::{Split, Trial, full_name};
use stretch_gap::Diagnosis;
use stretch_problem::{Causes, causes, name_of};
use stretch_recording::{ReadOptions, RecordingError, tidy_column};
use stretch_report::{Context, Judged, calibration_report, calibration_verdict};
use stretch_sleeve::{calibrate_gauge, missing_turns};

use super::{
    calibrate_sleeve,
    calibration_text::{blocks_of_calibration, blocks_of_models, blocks_of_notes},
    json::Json,
    reading::{Recorded, columns, read_trials, with_columns_to_name},
    shared::{
        Completed, detail, doubt, of_files, say_below, say_first, spinner, stage_text, with_unit,
    },
};

/// Fit a calibration to logged trials
///
/// Each trial is a recording (CSV in any dialect, NPY, NPZ) with the time, the
/// signal and the reference; - is standard input. Of a folder with a dataset.toml,
/// the trials with split = "fit" are used. The calibration file contains everything
/// that `apply`, `evaluate` and `export` need.
///
/// Examples:
///
///   stretch calibrate ramps/*.csv --out cal.json --report cal.html
///   stretch calibrate knee.csv --reference angle_deg --signal auto --out cal.json
///   stretch calibrate weights.csv --reference load_g --signal raw --model curve --out cal.json
///   stretch calibrate ramps/*.csv --rate paper --out published.json
///   stretch calibrate ramps/*.csv --model observer --out cal.json
///   stretch calibrate knee.csv --reference angle_deg --signal s1,s2,s3 --out cal.json
///   stretch calibrate wrist.csv --reference bend_deg,turn_deg --signal all --out wrist.json
///   stretch calibrate --prior prior.json --of left/anna half_a_minute.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Trials to fit, or a folder with a dataset.toml
    #[arg(required_unless_present = "prior", value_name = "TRIAL.csv")]
    pub(super) trials: Vec<PathBuf>,
    /// Calibration file to write
    ///
    /// It is JSON, or, if the name ends in .postcard, postcard for a board.
    #[arg(long, value_name = "cal.json")]
    pub(super) out: PathBuf,
    /// Report with figures to write
    #[arg(long, value_name = "r.html", conflicts_with_all = SLEEVE)]
    pub(super) report: Option<PathBuf>,
    /// Trials on which the calibration is judged [default: the fitted ones]
    #[arg(long, value_name = "TRIAL.csv", num_args = 1.., conflicts_with_all = SLEEVE)]
    test: Vec<PathBuf>,
    /// linear, curve, polyIJ, observer, history, diagnosed, or auto [default: poly13]
    ///
    /// curve is a polynomial of the signal alone, with a degree chosen by cross-validation; curve and linear also accept a table of
    /// weights and readings without a time. polyIJ is of degree I in the rate and J in the signal. observer, history and diagnosed
    /// have memory; observer+rest and history+rest also follow a drifting baseline. auto takes the model with the smallest error on
    /// trials left out of the fit.
    #[arg(
        long,
        conflicts_with_all = SLEEVE,
        hide_possible_values = true,
        value_parser = Completed { names: models, parser: str::parse::<Model> }
    )]
    model: Option<Model>,
    /// Column of the reference, whose last part is the unit
    ///
    /// `Pos (mm)` becomes pos_mm. Several gauges can have several references, separated by commas, such as the angles of a wrist;
    /// each reference gets its own calibration file.
    #[arg(long, default_value = "length_mm", value_name = "COL", value_parser = columns)]
    pub(super) reference: String,
    /// Column of the signal, or of several gauges with commas [default: bridge_v]
    ///
    /// auto takes the best of all columns by cross-validation, auto:s1,s2 the best of these. s1,s2 are gauges that are calibrated
    /// together; all takes every column except the references.
    #[arg(long, value_name = "COL")]
    signal: Option<Signal>,
    #[command(flatten)]
    pub(super) recorded: Recorded,
    /// Estimator of the signal's rate, or paper: the method as published [default: savgol:11,2]
    ///
    /// savgol:WINDOW,DEGREE or savgol:WINDOW,DEGREE,DELAY (in samples), difference:CUTOFF_HZ, tracker:INDEX, central. paper:
    /// central differences, strain rate, one branch per trial, no dead band.
    #[arg(long, conflicts_with_all = SLEEVE)]
    rate: Option<Rate>,
    /// Down-weight outliers
    #[arg(long, value_enum, conflicts_with_all = SLEEVE)]
    robust: Option<Loss>,
    /// Zero of the signal [default: 1.24 for bridge_v, else 0]
    ///
    /// It is subtracted before the signal is divided by its range.
    #[arg(long, value_name = "X", allow_hyphen_values = true, conflicts_with_all = SLEEVE)]
    signal_zero: Option<f64>,
    /// Resting length, from which contraction is measured
    ///
    /// By default it is the largest value of a reference called length...; any other reference is estimated directly. With +rest, the
    /// end at which the reference rests most is detected.
    #[arg(long, value_name = "X", conflicts_with = "prior")]
    pub(super) rest_length: Option<f64>,
    /// Diagnosis whose effects --model diagnosed and auto use
    ///
    /// `stretch diagnose --json=d.json` writes it. By default the trials are diagnosed as a gauge alone.
    #[arg(long, value_name = "d.json", conflicts_with_all = SLEEVE)]
    from: Option<PathBuf>,
    /// Prior that these trials update
    ///
    /// `stretch sleeve learn` writes it. For several gauges, ten seconds to a minute of reference are enough; without a trial the
    /// calibration is the prior. For one gauge, --model auto with 30 s of reference is usually more accurate.
    #[arg(long, value_name = "prior.json")]
    pub(super) prior: Option<PathBuf>,
    /// What the prior knows of this session: sensor/wearer/activity, such as left/anna
    ///
    /// Give as many of these parts as are known.
    #[arg(long, default_value = "", hide_default_value = true, value_name = "PATH")]
    pub(super) of: String,
    /// Session file to write, for stretch sleeve learn
    #[arg(long, value_name = "session.json")]
    pub(super) session: Option<PathBuf>,
    /// Write the calibration even if it explains nothing
    #[arg(long, conflicts_with_all = SLEEVE)]
    force: bool,
    #[command(flatten)]
    pub(super) json: Json,
}

/// Options that `calibrate_sleeve` handles. They cannot be combined with options that apply only to one gauge without a
/// prior.
const SLEEVE: [&str; 2] = ["prior", "session"];

/// Columns of signals, as selected with `--signal`.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Signal {
    One(String),
    /// The best of these columns; of all columns if the list is empty.
    Best(Vec<String>),
    /// Gauges that are calibrated together; all columns if the list is empty.
    Together(Vec<String>),
}

impl FromStr for Signal {
    type Err = Infallible;

    fn from_str(text: &str) -> Result<Self, Infallible> {
        let names = |text: &str| text.split(',').map(|name| tidy_column(name.trim())).collect();
        Ok(match text.strip_prefix("auto:") {
            Some(these) => Self::Best(names(these)),
            None if text == "auto" => Self::Best(Vec::new()),
            None if text == "all" => Self::Together(Vec::new()),
            None if text.contains(',') => Self::Together(names(text)),
            None => Self::One(tidy_column(text.trim())),
        })
    }
}

/// An estimator of the rate, or the complete published method.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rate {
    Paper,
    Of(RateEstimator),
}

impl FromStr for Rate {
    type Err = SpellingError;

    fn from_str(text: &str) -> Result<Self, SpellingError> {
        if text == "paper" { Ok(Self::Paper) } else { parse_rate(text).map(Self::Of) }
    }
}

/// Returns the names that a shell completes after `--model`, which takes further degrees of a surface.
fn models() -> Vec<String> {
    let named = ModelKind::named().into_iter().map(|kind| kind.to_string());
    ["auto", "curve"].map(str::to_owned).into_iter().chain(named).collect()
}

/// A model, or the automatic choice of one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Model {
    Auto,
    One(ModelKind),
}

impl FromStr for Model {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let model = text.parse().map(Self::One);
        model.map_err(|error: SpellingError| format!("{error}; or auto, which chooses one of them"))
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Loss {
    Bisquare,
    /// Least absolute residuals
    Lar,
}

impl Args {
    /// Returns the signal selection, by default `bridge_v`.
    pub(super) fn signal(&self) -> Signal {
        self.signal.clone().unwrap_or_else(|| Signal::One("bridge_v".to_owned()))
    }

    /// Whether `--signal` was given.
    pub(super) fn names_signals(&self) -> bool {
        self.signal.is_some()
    }

    fn model(&self) -> Model {
        self.model.unwrap_or(Model::One(Options::default().model))
    }

    /// Whether several gauges, a prior or a session file are requested.
    fn is_sleeve(&self) -> anyhow::Result<bool> {
        let is_together = matches!(self.signal(), Signal::Together(_));
        let is_of_one = self.model.is_some()
            || self.rate.is_some()
            || self.robust.is_some()
            || self.signal_zero.is_some()
            || self.from.is_some()
            || !self.test.is_empty()
            || self.force;
        ensure!(
            !(is_together && is_of_one),
            "--signal: several gauges are calibrated together, with a fixed model: remove --model, --rate, --robust, \
             --signal-zero, --from, --test and --force, or use --signal auto:s1,s2 for the best of several columns"
        );
        Ok(is_together || self.prior.is_some() || self.session.is_some())
    }

    fn options(&self) -> Options {
        let base = match self.rate {
            Some(Rate::Paper) => Options::paper(),
            Some(Rate::Of(rate)) => Options { rate, ..Options::default() },
            None => Options::default(),
        };
        Options {
            signal: match self.signal() {
                Signal::One(name) => name,
                _ => String::new(),
            },
            reference: self.reference.clone(),
            // `--signal auto` and `--model auto` begin with the published model.
            model: match self.model() {
                Model::Auto => base.model,
                Model::One(kind) => kind,
            },
            robust: match self.robust {
                None => Robust::Off,
                Some(Loss::Bisquare) => Robust::Bisquare,
                Some(Loss::Lar) => Robust::Lar,
            },
            signal_zero: self.signal_zero,
            rest_length: self.rest_length,
            time: self.recorded.stored_time(),
            ..base
        }
    }

    /// Returns the paths of the calibration file and the report.
    fn written(&self) -> impl Iterator<Item = &Path> {
        std::iter::once(&self.out).chain(&self.report).map(PathBuf::as_path)
    }

    /// Reads the trials. The flag tells whether they are tables without a time, to which only a
    /// line or a curve can be fitted.
    fn read(&self, columns: &mut ReadOptions) -> anyhow::Result<(Vec<Trial>, bool)> {
        let own = "name your columns with --reference and --signal";
        let error = match read_trials(&self.trials, Split::Fit, columns) {
            Ok(trials) => return Ok((trials, false)),
            Err(error) => error,
        };
        if !matches!(error.downcast_ref(), Some(RecordingError::MissingTime { .. })) {
            return Err(with_columns_to_name(error, own));
        }
        let models = [Model::Auto, Model::One(ModelKind::Linear), Model::One(ModelKind::Curve)];
        ensure!(
            models.contains(&self.model()),
            "{error}; to calibrate weights and readings without a time, give --model curve or --model linear"
        );
        // The time of a table is its row number.
        *columns = columns.clone().untimed_hz(1.0);
        Ok((read_trials(&self.trials, Split::Fit, columns)?, true))
    }

    /// Returns the effects that a diagnosis names, if the model needs them. The diagnosis is read
    /// from `--from`, or made here from the trials of the gauge alone.
    fn causes(&self, trials: &[Trial], options: &Options) -> anyhow::Result<Causes> {
        match (self.model(), &self.from) {
            (Model::One(kind), _)
                if !matches!(kind, ModelKind::Remembering { kind: Memory::Diagnosed, .. }) =>
            {
                Ok(Causes::default())
            }
            (_, Some(path)) => read_causes(path, &self.trials),
            (_, None) => {
                let bar = spinner();
                bar.set_message("diagnosing the gauge");
                let show = |text: &str| bar.set_message(text.to_owned());
                let causes = Causes::of(trials, options, &show, &|| false);
                bar.finish_and_clear();
                Ok(causes)
            }
        }
    }
}

/// A diagnosis with the name of its data set.
#[derive(Deserialize)]
struct Stored {
    #[serde(flatten)]
    diagnosis: Diagnosis,
    data_set: Option<String>,
}

/// Reads the effects that a stored diagnosis names, for use with these trials.
fn read_causes(path: &Path, trials: &[PathBuf]) -> anyhow::Result<Causes> {
    let name = || path.display().to_string();
    let text = String::from_utf8(read_whole(path).with_context(name)?).with_context(name)?;
    let Stored { diagnosis, data_set } = serde_json::from_str(&text).with_context(|| {
        format!(
            "{}: this is not a diagnosis of this release; make one with stretch diagnose --json=d.json",
            name()
        )
    })?;
    let found = causes(&diagnosis);
    if found.is_empty() {
        bail!(
            "{}: this diagnosis names no effect of the gauge or its reference. It says: {} Calibrate with --model observer or auto without --from",
            name(),
            diagnosis.sentence
        );
    }
    let of = data_set.as_ref().map_or(String::new(), |set| format!(", a diagnosis of {set}"));
    let mut notes =
        vec![format!("the model uses the effects of {}{of}: {}", name(), diagnosis.sentence)];
    // The diagnosis of another rig is permitted, because it may apply to rigs of the same type. A note names both data
    // sets.
    if let ([own], Some(set)) = (trials, &data_set)
        && name_of(own) != *set
    {
        notes.push(format!(
            "the diagnosis is of {set}, but these trials are of {}: if that is another rig, diagnose it, or remove --from",
            name_of(own)
        ));
    }
    Ok(Causes { found, notes })
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let files = [Some(args.out.as_path()), args.report.as_deref(), args.session.as_deref()];
    args.json.share_stdout(files)?;
    if args.is_sleeve()? {
        return calibrate_sleeve::run(&args);
    }
    ensure!(
        !args.reference.contains(','),
        "--reference {}: several references need several gauges; name the gauges with --signal s1,s2",
        args.reference
    );
    let mut options = args.options();
    let signal = args.signal();
    let named: &[String] = match &signal {
        Signal::One(name) => std::slice::from_ref(name),
        Signal::Best(names) | Signal::Together(names) => names,
    };
    let columns = args.recorded.options().require(&args.reference);
    let mut columns = match named {
        [] => columns.all_columns(),
        named => named.iter().fold(columns, |columns, name| columns.require(name)),
    };
    let (trials, is_table) = args.read(&mut columns)?;
    options = options.named_as(&trials);
    options.is_table = is_table;
    // Outliers are removed only from columns that the user names, because a candidate column may hold any quantity.
    // Rows of a table may be far apart, so nothing is removed from tables.
    let named = [options.reference.clone(), options.signal.clone()];
    let named = [named[0].as_str(), named[1].as_str()];
    let named = if is_table { &[][..] } else { &named[..] };
    let (trials, mut left_out) = without_gross_errors(trials, named);
    let (trials, clipped) = match named {
        [reference, signal] => without_clipped(trials, [signal, reference]),
        _ => (trials, Vec::new()),
    };
    left_out.extend(clipped);
    let named = |error: CalibrateError| of_files(error, &args.trials);
    let ranking = rank(&trials, &signal, &args, &options)?;
    if let Some(best) = ranking.first() {
        options.signal.clone_from(&best.signal);
    }
    let causes = match is_table {
        true => Causes::default(),
        false => args.causes(&trials, &options)?.without_missing_pressure(&trials),
    };
    options.causes.clone_from(&causes.found);
    let choice = match args.model() {
        Model::Auto => Some(choose(&trials, &options).map_err(named)?),
        Model::One(_) => None,
    };
    if let Some(choice) = &choice {
        options.model = choice.model;
        detail(format!("chose a model: {}", choice.why));
    }
    let mut calibrated = calibrate(&trials, &options).map_err(named)?;
    detail(format!("fitted {} to {} on {}", options.model, options.reference, options.signal));
    let candidates: Vec<String> = ranking.iter().map(|signal| signal.signal.clone()).collect();
    let line =
        choice.is_none().then(|| worse_than_a_line(&calibrated, &trials, &options)).flatten();
    let first = line.into_iter().chain(left_out).chain(copied_signals(&trials, &candidates));
    calibrated.doubts.splice(0..0, first);
    accept(&mut calibrated, &args)?;
    calibrated.notes.extend(causes.notes);
    calibrated.notes.extend(choice.iter().flat_map(|choice| choice.notes.clone()));
    calibrated.doubts.iter().for_each(doubt);
    let mut outputs = Outputs::default();
    let gauge = calibrate_gauge(calibrated.calibration.clone(), &trials, &options);
    let gauge = gauge.map_err(named)?;
    let record = gauge.bytes(&args.out)?;
    if !is_table {
        calibrated.notes.extend(missing_turns(&gauge, &trials));
    }
    outputs.file(&args.out, |out| out.write_all(&record))?;
    let test = read_trials(&args.test, Split::Test, &columns)?;
    let chosen = (&ranking[..], choice.as_ref());
    let judged = judge(&args, &mut outputs, &calibrated, [&trials, &test], chosen, &options)?;
    let answer = serde_json::json!({
        "signal": options.signal,
        "candidates": ranking,
        "models": choice.as_ref().map_or(&[][..], |choice| &choice.rows),
        "model": options.model.to_string(),
        "why": choice.as_ref().map(|choice| &choice.why),
        "fits": calibrated.fits,
        "notes": calibrated.doubts.iter().chain(&calibrated.notes).collect::<Vec<_>>(),
    });
    args.json.conclude(outputs, &answer, || {
        let models = choice.as_ref().map(|choice| blocks_of_models(choice, &options.reference));
        let (sentence, tested) = match &choice {
            None => (judged, None),
            Some(choice) => {
                (choice_in_words(choice, &ranking), (!test.is_empty()).then_some(judged))
            }
        };
        say_first(sentence)?;
        let fits = blocks_of_calibration(&calibrated, &ranking, choice.is_some());
        let tables = tested.into_iter().chain(models.into_iter().flatten()).chain(fits);
        say_below(tables.chain(blocks_of_notes(&calibrated.notes)), args.written())
    })
}

/// Returns the sentence with the chosen model, and the signal if that was chosen as well.
fn choice_in_words(choice: &ModelChoice, ranking: &[Candidate]) -> String {
    let signal = ranking.first().map_or(String::new(), |best| {
        format!("signal {}, the best of {}; ", best.signal, ranking.len())
    });
    format!("Chosen: {signal}{}.", choice.why)
}

/// Ranks the signals of `--signal auto`, and returns none for any other signal.
fn rank(
    trials: &[Trial],
    signal: &Signal,
    args: &Args,
    options: &Options,
) -> anyhow::Result<Vec<Candidate>> {
    let Signal::Best(names) = signal else { return Ok(Vec::new()) };
    let names = match &names[..] {
        [] => other_columns(trials, std::slice::from_ref(&options.reference))?,
        names => full_names(trials, names),
    };
    let ranking = rank_signals(trials, &names, options);
    let ranking = ranking.map_err(|error| of_files(error, &args.trials))?;
    if let Some(best) = ranking.first() {
        detail(format!("chose the signal {} from {} candidates", best.signal, ranking.len()));
    }
    Ok(ranking)
}

/// Accepts a fit unless it explains nothing, and adds a note if it explains little. With `--force`, accepts any fit.
fn accept(calibrated: &mut Calibrated, args: &Args) -> anyhow::Result<()> {
    match explains_nothing(&calibrated.fits) {
        Some(why) if args.force => {
            calibrated.doubts.push(format!("{why}; written because of --force"))
        }
        Some(why) => {
            let refusal = anyhow!("nothing is written: {why}; give --force to write it anyway");
            return Err(of_files(refusal, &args.trials));
        }
        None => calibrated.doubts.extend(explains_little(&calibrated.fits)),
    }
    Ok(())
}

/// Chooses a model. On a terminal, shows how many models have been cross-validated.
fn choose(trials: &[Trial], options: &Options) -> Result<ModelChoice, CalibrateError> {
    let bar = spinner();
    let show =
        |done: usize, of: usize| bar.set_message(format!("judging {of} models, {done} done"));
    let choice = choose_model_watched(trials, options, &show);
    bar.finish_and_clear();
    choice
}

/// Calibrates with a straight line on the same trials and columns.
fn straight_line(trials: &[Trial], options: &Options) -> Result<Calibrated, CalibrateError> {
    calibrate(trials, &Options { model: ModelKind::Linear, ..options.clone() })
}

/// A note is given if the error of a model is more than this multiple of the error of a straight line.
const WORSE: f64 = 1.05;

/// Returns a note if a straight line through the fitted trials has a smaller error than the calibration.
fn worse_than_a_line(
    calibrated: &Calibrated,
    trials: &[Trial],
    options: &Options,
) -> Option<String> {
    let line =
        (options.model != ModelKind::Linear).then(|| straight_line(trials, options).ok())??;
    let both = [("chosen", &calibrated.calibration), ("linear", &line.calibration)];
    let evaluation = evaluate_errors(&both, trials).ok()?;
    let [_, own, line] = &evaluation.pooled[..] else { return None };
    (own.rmse > WORSE * line.rmse).then(|| {
        let unit = &evaluation.unit;
        let numbers = [own.rmse, line.rmse].map(|rmse| with_unit(rmse, unit));
        format!(
            "{} is worse than a straight line on the trials of the fit (RMSE {}, linear {}): use --model auto",
            options.model, numbers[0], numbers[1]
        )
    })
}

/// Evaluates a calibration on the test trials, or on the fitted trials if there are none. Adds the report to the
/// outputs, if there is one, and returns the sentence with the error.
fn judge(
    args: &Args,
    outputs: &mut Outputs,
    calibrated: &Calibrated,
    [trials, test]: [&[Trial]; 2],
    chosen: (&[Candidate], Option<&ModelChoice>),
    options: &Options,
) -> anyhow::Result<String> {
    let Some(path) = &args.report else {
        let name = options.model.to_string();
        let judged = if test.is_empty() { trials } else { test };
        let evaluation = evaluate_errors(&[(&name, &calibrated.calibration)], judged);
        return Ok(verdict(calibrated, trials, evaluation, options));
    };
    // The line is the baseline with which every surface is compared.
    let linear = straight_line(trials, options).map_err(|error| of_files(error, &args.trials))?;
    let both = [&linear, calibrated];
    let (page, evaluation) = calibration_report(both, [trials, test], chosen, options)?;
    stage_text(outputs, path, &page)?;
    Ok(verdict(calibrated, trials, Ok(evaluation), options))
}

/// Returns the sentence with the error of a calibration.
fn verdict(
    calibrated: &Calibrated,
    trials: &[Trial],
    evaluation: Result<Evaluation, CalibrateError>,
    options: &Options,
) -> String {
    let name = options.model.to_string();
    let evaluation = match evaluation {
        Ok(evaluation) => evaluation,
        Err(error) => return format!("{name} was fitted but not judged, because {error}."),
    };
    let calibrated_on = trials.iter().map(|trial| trial.name.clone()).collect();
    let context = Context { calibrated_on, ..Context::default() };
    calibration_verdict(&Judged {
        calibrated: &[(&name, calibrated)],
        evaluation: &evaluation,
        context: &context,
    })
}

/// Returns the full names of columns in the first trial.
pub(super) fn full_names(trials: &[Trial], names: &[String]) -> Vec<String> {
    names.iter().map(|name| full_name(trials.first(), name)).collect()
}

/// Returns the columns of the first trial, except those in `but` and the estimates of `stretch listen` or of the live
/// page.
///
/// # Errors
/// There is no other column.
pub(super) fn other_columns(trials: &[Trial], but: &[String]) -> anyhow::Result<Vec<String>> {
    let channels = trials.first().into_iter().flat_map(|trial| &trial.channels);
    let names = channels
        .map(|channel| channel.name.clone())
        .filter(|name| !but.contains(name) && !name.starts_with("estimate"));
    let names: Vec<String> = names.collect();
    ensure!(
        !names.is_empty(),
        "{}: no column of numbers is left for a signal; the columns of numbers are the time and {}: name the signal with --signal",
        trials.first().map_or("", |trial| trial.name.as_str()),
        but.join(", ")
    );
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_is_one_column_the_best_of_some_or_gauges_together() {
        let names = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        for (text, signal) in [
            ("Gauge (V)", Signal::One("gauge_v".to_owned())),
            ("auto", Signal::Best(Vec::new())),
            ("auto:s1, s2", Signal::Best(names(&["s1", "s2"]))),
            ("all", Signal::Together(Vec::new())),
            ("s1,s2", Signal::Together(names(&["s1", "s2"]))),
        ] {
            assert_eq!(text.parse(), Ok(signal), "{text}");
        }
        assert_eq!("paper".parse(), Ok(Rate::Paper));
        assert_eq!("savgol:11,2".parse(), Ok(Rate::Of(RateEstimator::SAVGOL_11_2)));
    }
}
