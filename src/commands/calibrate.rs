//! `stretch calibrate`: from logged trials to a calibration record.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::ValueEnum;
use serde::Serialize;
use stretch_calibrate::{
    CalibrateError, Calibrated, Candidate, FitReport, MODELS_IN_WORDS, Memory, ModelChoice,
    ModelKind, ModelRow, Options, Robust, SpellingError, calibrate, choose_model, evaluate,
    explains_little, explains_nothing, parse_rate, rank_signals, without_gross_errors,
};
use stretch_core::RateEstimator;
use stretch_data::files::Outputs;
use stretch_data::{Split, Trial};
use stretch_problem::Causes;
use stretch_recording::{ReadOptions, RecordingError, tidy_column};
use stretch_report::{Context, Judged, calibration_page};
use stretch_sleeve::calibrate_gauge;

use super::{
    calibrate_sleeve::{Asked, Sleeve},
    calibration_text::{print, print_models},
    causes,
    json::Json,
    reading::{Recorded, read_trials, with_columns_to_name},
    shared::{detail, of_files, stage_text, tell},
};

/// Fit a calibration to logged trials
///
/// Each trial is a recording (CSV in any dialect, NPY, NPZ) with the
/// time, the signal and the reference, - is standard input; a folder with a dataset.toml stands for its fit trials. The
/// record that is written holds all that `apply` or a board needs: surfaces,
/// ranges, rate estimator, dead band, domain, and where it comes from.
///
/// Examples:
///
///   stretch calibrate ramps/*.csv --out cal.json --report cal.html
///   stretch calibrate knee.csv --reference angle_deg --signal auto --out cal.json
///   stretch calibrate weights.csv --reference load_g --signal raw --model curve --out cal.json
///   stretch calibrate ramps/*.csv --paper --out published.json
///   stretch calibrate ramps/*.csv --model observer --out cal.json
///   stretch calibrate knee.csv --reference angle_deg --signals s1,s2,s3 --out cal.json
///   stretch calibrate wrist.csv --reference bend_deg,turn_deg --signals all --out wrist.json
///   stretch calibrate --prior prior.json --of left/anna half_a_minute.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Trials to fit, or a folder with a dataset.toml
    #[arg(required_unless_present = "prior", value_name = "TRIAL.csv")]
    trials: Vec<PathBuf>,
    /// Where the record goes
    ///
    /// It is JSON, or postcard for a board when the name ends in .postcard.
    #[arg(long, value_name = "cal.json")]
    out: PathBuf,
    /// Where a report with pictures goes
    #[arg(long, value_name = "r.html")]
    report: Option<PathBuf>,
    /// Trials that the report judges on [default: those that were fitted]
    #[arg(long, value_name = "TRIAL.csv", num_args = 1..)]
    test: Vec<PathBuf>,
    /// linear, curve, polyIJ, observer, history, diagnosed, or auto
    ///
    /// curve is a polynomial of the signal alone, its degree by cross-validation; curve and linear also take a table of weights and
    /// readings without a time. polyIJ is of degree I in the rate and J in the signal. observer, history and diagnosed remember; +rest behind observer or
    /// history follows a drifting baseline. auto takes the best on trials left out.
    #[arg(long, default_value = "poly13")]
    model: Model,
    /// Column of the reference, whose last part is the unit
    ///
    /// `Pos (mm)` is pos_mm. With --signals several with commas, such as the angles of a wrist: each gets a record of its own.
    #[arg(long, default_value = "length_mm", value_name = "COL", value_parser = columns)]
    reference: String,
    /// Column of the signal, or auto: the best of all columns
    ///
    /// Several with commas, too: the best of them by cross-validation.
    #[arg(long, default_value = "bridge_v", value_name = "COL", value_parser = columns)]
    signal: String,
    #[command(flatten)]
    recorded: Recorded,
    /// Estimator of the signal's rate
    ///
    /// savgol:WINDOW,DEGREE or savgol:WINDOW,DEGREE,DELAY (in samples), difference:CUTOFF_HZ, tracker:INDEX, central.
    #[arg(long, default_value = "savgol:11,2", value_parser = parse_rate)]
    rate: RateEstimator,
    /// The method as published
    ///
    /// Central differences, strain rate, a branch a trial, no dead band.
    #[arg(long, conflicts_with = "rate")]
    paper: bool,
    /// Weigh outliers down
    #[arg(long, value_enum)]
    robust: Option<Loss>,
    /// Zero of the signal [default: 1.24 for bridge_v, else 0]
    ///
    /// It is subtracted before the signal is divided by its range.
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    signal_zero: Option<f64>,
    /// Resting length, from which contraction is counted
    ///
    /// By default it is the greatest value of a reference called length...; any other reference is the target itself.
    #[arg(long, value_name = "X")]
    rest_length: Option<f64>,
    /// Diagnosis whose effects --model diagnosed and auto build on
    ///
    /// `stretch diagnose --json=d.json` writes it. By default the trials are diagnosed as a gauge alone.
    #[arg(long, value_name = "d.json")]
    from: Option<PathBuf>,
    #[command(flatten)]
    sleeve: Sleeve,
    /// Write a calibration that explains nothing, too
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    json: Json,
}

/// Several columns, with commas.
fn columns(names: &str) -> Result<String, std::convert::Infallible> {
    Ok(names.split(',').map(|name| tidy_column(name.trim())).collect::<Vec<_>>().join(","))
}

/// A model, or the choice of one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Model {
    Auto,
    One(ModelKind),
}

impl std::str::FromStr for Model {
    type Err = SpellingError;

    fn from_str(text: &str) -> Result<Self, SpellingError> {
        if text == "auto" { Ok(Self::Auto) } else { text.parse().map(Self::One) }
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Loss {
    Bisquare,
    /// Least absolute residuals
    Lar,
}

impl Args {
    fn options(&self) -> Options {
        let base = if self.paper {
            Options::paper()
        } else {
            Options { rate: self.rate, ..Options::default() }
        };
        Options {
            signal: self.signal.clone(),
            reference: self.reference.clone(),
            // a signal is ranked, and a model chosen, beginning from the published one
            model: match self.model {
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
            ..base
        }
    }

    /// The trials, and whether they are tables without a time, to which a line or a curve can be fitted.
    fn read(&self, columns: &mut ReadOptions) -> anyhow::Result<(Vec<Trial>, bool)> {
        let own = "name the columns of yours with --reference and --signal";
        let error = match read_trials(&self.trials, Split::Fit, columns) {
            Ok(trials) => return Ok((trials, false)),
            Err(error) => error,
        };
        if !matches!(error.downcast_ref(), Some(RecordingError::MissingTime { .. })) {
            return Err(with_columns_to_name(error, own));
        }
        let models = [Model::Auto, Model::One(ModelKind::Linear), Model::One(ModelKind::Curve)];
        anyhow::ensure!(
            models.contains(&self.model),
            "{error}; weights and readings without a time are calibrated with --model curve or --model linear"
        );
        // the time of a table is the number of the row
        *columns = columns.clone().untimed_hz(1.0);
        Ok((read_trials(&self.trials, Split::Fit, columns)?, true))
    }

    /// What a diagnosis names, where the model asks for it.
    fn causes(&self, trials: &[Trial], options: &Options) -> anyhow::Result<Causes> {
        let is_asked = match self.model {
            Model::Auto => true,
            Model::One(kind) => {
                matches!(kind, ModelKind::Remembering { kind: Memory::Diagnosed, .. })
            }
        };
        if let Some(path) = self.from.as_ref().filter(|_| is_asked) {
            return causes::read(path, &self.trials);
        }
        match is_asked {
            true => Ok(causes::of(trials, options)),
            false => Ok(Causes::default()),
        }
    }

    /// The signals to choose from; none when one was named.
    fn candidates(&self, trials: &[Trial]) -> Vec<String> {
        if self.signal == "auto" {
            let channels = trials.first().map(|trial| trial.channels.as_slice()).unwrap_or(&[]);
            let named = channels.iter().map(|channel| channel.name.clone());
            return named.filter(|name| *name != self.reference).collect();
        }
        if self.signal.contains(',') {
            return self.signal.split(',').map(|name| name.trim().to_owned()).collect();
        }
        Vec::new()
    }
}

/// What `--json` prints.
#[derive(Serialize)]
struct Output<'a> {
    signal: &'a str,
    candidates: &'a [Candidate],
    models: &'a [ModelRow],
    model: String,
    why: Option<&'a str>,
    fits: &'a [FitReport],
    notes: &'a [String],
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let files = [Some(args.out.as_path()), args.report.as_deref()];
    args.json.share_stdout(files.into_iter().chain([args.sleeve.file()]))?;
    if args.sleeve.is_asked() {
        return args.sleeve.run(&Asked {
            trials: &args.trials,
            signal: &args.signal,
            reference: &args.reference,
            rest_length: args.rest_length,
            columns: args.recorded.options(),
            out: &args.out,
            json: &args.json,
        });
    }
    anyhow::ensure!(
        !args.reference.contains(','),
        "--reference {}: several references are those of several gauges; name these with --signals",
        args.reference
    );
    let mut options = args.options();
    let mut columns = args.recorded.options().require(&args.reference);
    if args.signal != "auto" {
        for signal in args.signal.split(',') {
            columns = columns.require(signal.trim());
        }
    }
    let (trials, is_table) = args.read(&mut columns)?;
    options.is_table = is_table;
    // signals that are only candidates may be anything, and the rows of a table may be far apart
    let named = [args.reference.as_str(), args.signal.as_str()];
    let named = if is_table { &[][..] } else { &named[..] };
    let (trials, gross_errors) = without_gross_errors(&trials, named);
    let named = |error: CalibrateError| of_files(error, &args.trials);
    let candidates = args.candidates(&trials);
    let ranking = if candidates.is_empty() {
        Vec::new()
    } else {
        rank_signals(&trials, &candidates, &options).map_err(named)?
    };
    if let Some(best) = ranking.first() {
        options.signal.clone_from(&best.signal);
        detail(format!("chose the signal {} of {}", best.signal, ranking.len()));
    }
    let causes = match is_table {
        true => Causes::default(),
        false => args.causes(&trials, &options)?.without_missing_pressure(&trials, &options),
    };
    options.causes.clone_from(&causes.found);
    let choice = match args.model {
        Model::Auto => Some(choose_model(&trials, &options).map_err(named)?),
        Model::One(_) => None,
    };
    if let Some(choice) = &choice {
        options.model = choice.model;
        detail(format!("chose a model: {}", choice.why));
    }
    let mut calibrated = calibrate(&trials, &options).map_err(named)?;
    detail(format!("fitted {} to {} on {}", options.model, options.reference, options.signal));
    calibrated.notes.splice(0..0, gross_errors);
    match explains_nothing(&calibrated.fits) {
        Some(why) if args.force => calibrated.notes.push(format!("{why}; written by --force")),
        Some(why) => {
            let refusal = anyhow!("nothing is written: {why}; --force writes it all the same");
            return Err(of_files(refusal, &args.trials));
        }
        None => calibrated.notes.extend(explains_little(&calibrated.fits)),
    }
    calibrated.notes.extend(causes.notes);
    calibrated.notes.extend(choice.iter().flat_map(|choice| choice.notes.clone()));
    let mut outputs = Outputs::default();
    let gauge = calibrate_gauge(calibrated.calibration.clone(), &trials, &options);
    let record = gauge.map_err(named)?.bytes(&args.out)?;
    outputs.file(&args.out, |out| out.write_all(&record))?;
    if let Some(path) = &args.report {
        // the line is the yardstick that every surface is held against
        let linear = Options { model: ModelKind::Linear, ..options.clone() };
        let linear = calibrate(&trials, &linear).map_err(named)?;
        let fitted = [&linear, &calibrated];
        let page = report(&args, &trials, &columns, fitted, (&ranking, choice.as_ref()), &options)?;
        stage_text(&mut outputs, path, &page)?;
    }
    let answer = Output {
        signal: &options.signal,
        candidates: &ranking,
        models: choice.as_ref().map_or(&[], |choice| &choice.rows),
        model: options.model.to_string(),
        why: choice.as_ref().map(|choice| choice.why.as_str()),
        fits: &calibrated.fits,
        notes: &calibrated.notes,
    };
    args.json.stage(&mut outputs, &answer)?;
    outputs.keep()?;
    args.json.say(&answer, || {
        if let Some(choice) = &choice {
            print_models(choice, &options.reference)?;
        }
        print(&calibrated, &ranking)?;
        tell(format!("wrote {}", args.out.display()))?;
        args.report.iter().try_for_each(|path| tell(format!("wrote {}", path.display())))
    })
}

fn report(
    args: &Args,
    trials: &[Trial],
    columns: &ReadOptions,
    [linear, calibrated]: [&Calibrated; 2],
    (ranking, choice): (&[Candidate], Option<&ModelChoice>),
    options: &Options,
) -> anyhow::Result<String> {
    let test = read_trials(&args.test, Split::Test, columns)?;
    let judged = if test.is_empty() { trials } else { &test };
    let name = options.model.to_string();
    let mut shown = vec![("linear", linear)];
    if options.model != ModelKind::Linear {
        shown.push((name.as_str(), calibrated));
    }
    let named: Vec<_> = shown.iter().map(|(name, c)| (*name, &c.calibration)).collect();
    let evaluation = evaluate(&named, judged)?;
    let names = |trials: &[Trial]| trials.iter().map(|trial| trial.name.clone()).collect();
    let context = Context {
        title: format!("Calibration of {} on {}", options.reference, options.signal),
        calibrated_on: names(trials),
        tested_on: names(&test),
        signal_choice: ranking.to_vec(),
        notes: choice
            .map(|choice| format!("{}; {MODELS_IN_WORDS}", choice.why))
            .into_iter()
            .chain(calibrated.notes.clone())
            .collect(),
        kinds: Vec::new(),
    };
    let judged = Judged { calibrated: &shown, evaluation: &evaluation, context: &context };
    Ok(calibration_page(&judged))
}
