//! `stretch calibrate`: from logged trials to a calibration record.

use std::path::PathBuf;

use anyhow::{Context as _, anyhow};
use clap::ValueEnum;
use serde::Serialize;
use stretch_calibrate::{
    CalibrateError, Calibrated, Candidate, FitReport, MODELS_IN_WORDS, Memory, ModelChoice,
    ModelKind, ModelRow, Options, Robust, SpellingError, SplitBy, calibrate, calibration_bytes,
    choose_model, evaluate, explains_little, explains_nothing, fixed_record, is_plain, parse_adc,
    parse_rate, rank_signals, without_gross_errors,
};
use stretch_core::{Normalisation, RateEstimator, RateSource};
use stretch_data::{Split, Trial};
use stretch_files::Outputs;
use stretch_problem::Causes;
use stretch_receptor::code::Adc;
use stretch_recording::{ReadOptions, tidy_column};
use stretch_report::{Context, Judged, calibration_page};

use super::{
    calibration_text::{print, print_models},
    causes,
    json::Json,
    long::Long,
    reading::{Recorded, read_trials, with_columns_to_name},
    shared::{detail, of_files, stage_text, tell},
    sleeve::{Asked, Sleeve},
};

/// Fit a calibration to logged trials
///
/// Each trial is a recording (CSV in any dialect, NPZ, MAT, ...) with the
/// time, the signal and the reference, - is standard input; a folder with a dataset.toml stands for its fit trials. The
/// record that is written holds all that `apply` or a board needs: surfaces,
/// ranges, rate estimator, dead band, domain, and where it comes from.
///
/// Examples:
///
///   stretch calibrate ramps/*.csv --out cal.json --report cal.html
///   stretch calibrate knee.csv --reference angle_deg --signal auto --out cal.json
///   stretch calibrate ramps/*.csv --paper --out published.json
///   stretch calibrate ramps/*.csv --model observer --out cal.json --fixed cal.fixed.postcard
///   stretch calibrate knee.csv --reference angle_deg --signals s1,s2,s3 --out cal.json
///   stretch calibrate wrist.csv --reference bend_deg,turn_deg --signals all --out wrist.json
///   stretch calibrate --prior prior.json --of left/anna half_a_minute.csv --out cal.json
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Trials to fit, or a folder with a dataset.toml
    #[arg(required_unless_present = "prior", value_name = "TRIAL.csv")]
    trials: Vec<PathBuf>,
    /// What to fit: linear; polyIJ of degree I in the rate and J in the signal; blended (poly13
    /// without the jump at a reversal); hysteresis, relaxation, both, history or observer, which
    /// remember, also with +rest to follow a drifting baseline; auto: the best on trials left out
    #[arg(long, default_value = "poly13")]
    model: Model,
    /// How channels are normalised: divided by their range, or minimum to maximum
    #[arg(long, value_enum, default_value_t = Normalise::Range)]
    normalise: Normalise,
    /// Estimator of the signal's rate: savgol:WINDOW,DEGREE or savgol:WINDOW,DEGREE,DELAY (in
    /// samples), difference:CUTOFF_HZ, tracker:INDEX, central
    #[arg(long, default_value = "savgol:11,2", value_parser = parse_rate)]
    rate: RateEstimator,
    /// Rate that surfaces are fitted on: the signal's, as it will run, or the reference's, as in
    /// the paper
    #[arg(long, value_enum, default_value_t = Source::Voltage)]
    rate_source: Source,
    /// How samples are given to the branches: by the sign of the rate, or a trial each
    #[arg(long, value_enum, default_value_t = BranchBy::Rate)]
    branch_by: BranchBy,
    /// The method as published: central differences, strain rate, a branch a trial, no dead band
    #[arg(long, conflicts_with_all = ["rate", "rate_source", "branch_by", "dead_band"])]
    paper: bool,
    /// Column of the reference; its last part is the unit of the estimate (`Pos (mm)` is pos_mm). With --signals several with
    /// commas, such as the angles of a wrist: each gets a record of its own
    #[arg(long, default_value = "length_mm", value_name = "COL", value_parser = columns)]
    reference: String,
    /// Column of the signal, several with commas, or `auto`: the best by cross-validation
    #[arg(long, default_value = "bridge_v", value_name = "COL", value_parser = columns)]
    signal: String,
    #[command(flatten)]
    recorded: Recorded,
    /// Zero of the signal, subtracted before it is divided by its range [default: 1.24 for
    /// bridge_v, else 0]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    signal_zero: Option<f64>,
    /// Resting length: the target is then the contraction [default: the greatest value of a
    /// reference called length..., else the reference itself is the target]
    #[arg(long, value_name = "X")]
    rest_length: Option<f64>,
    /// Rates this close to zero keep the branch, in signal units per second [default: three
    /// standard deviations of the rate's noise]
    #[arg(long, value_name = "X")]
    dead_band: Option<f64>,
    /// Weigh outliers down: bisquare, or least absolute residuals
    #[arg(long, value_enum)]
    robust: Option<Loss>,
    /// Date for the record, as free text
    #[arg(long, default_value = "", hide_default_value = true)]
    date: String,
    /// Trials that the report judges the calibration on [default: those that were fitted]
    #[arg(long, value_name = "TRIAL.csv", num_args = 1..)]
    test: Vec<PathBuf>,
    /// A diagnosis (`stretch diagnose --json-out d.json`) whose named effects --model diagnosed and auto build on [default: the
    /// trials are diagnosed as a gauge alone]
    #[arg(long, value_name = "d.json")]
    from: Option<PathBuf>,
    /// Where the record goes: JSON, or postcard for a board when the name ends in .postcard
    #[arg(long, value_name = "cal.json")]
    out: PathBuf,
    /// Where the record goes that a board without floating point runs, in postcard: converter
    /// codes in, thousandths of the reference's unit out. For linear, poly13, observer and
    /// observer+rest
    #[arg(long, value_name = "cal.fixed.postcard")]
    fixed: Option<PathBuf>,
    /// The board's converter: bits, and the signal at code 0 and at the last code
    #[arg(long, default_value = "12,0,3.3", value_name = "BITS,ZERO_V,FULL_SCALE_V",
          value_parser = parse_adc, requires = "fixed")]
    adc: Adc,
    #[command(flatten)]
    sleeve: Sleeve,
    /// Write a calibration that explains nothing, too
    #[arg(long)]
    force: bool,
    /// Where a report with pictures goes
    #[arg(long, value_name = "r.html")]
    report: Option<PathBuf>,
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
enum Normalise {
    Range,
    MinMax,
}

#[derive(Clone, Copy, ValueEnum)]
enum Source {
    Strain,
    Voltage,
}

#[derive(Clone, Copy, ValueEnum)]
enum BranchBy {
    Rate,
    Trial,
}

#[derive(Clone, Copy, ValueEnum)]
enum Loss {
    Bisquare,
    Lar,
}

impl Args {
    fn options(&self) -> Options {
        let base = if self.paper {
            Options::paper()
        } else {
            Options {
                rate: self.rate,
                rate_source: match self.rate_source {
                    Source::Strain => RateSource::Strain,
                    Source::Voltage => RateSource::Voltage,
                },
                split: match self.branch_by {
                    BranchBy::Rate => SplitBy::Rate,
                    BranchBy::Trial => SplitBy::Trial,
                },
                dead_band: self.dead_band,
                ..Options::default()
            }
        };
        Options {
            signal: self.signal.clone(),
            reference: self.reference.clone(),
            // a signal is ranked, and a model chosen, beginning from the published one
            model: match self.model {
                Model::Auto => base.model,
                Model::One(kind) => kind,
            },
            normalisation: match self.normalise {
                Normalise::Range => Normalisation::Range,
                Normalise::MinMax => Normalisation::MinMax,
            },
            robust: match self.robust {
                None => Robust::Off,
                Some(Loss::Bisquare) => Robust::Bisquare,
                Some(Loss::Lar) => Robust::Lar,
            },
            signal_zero: self.signal_zero,
            rest_length: self.rest_length,
            date: self.date.clone(),
            ..base
        }
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
    let files = [Some(args.out.as_path()), args.fixed.as_deref(), args.report.as_deref()];
    args.json.share_stdout(files.into_iter().chain(args.sleeve.files()))?;
    if args.sleeve.is_asked() {
        return args.sleeve.run(&Asked {
            trials: &args.trials,
            signal: &args.signal,
            reference: &args.reference,
            rest_length: args.rest_length,
            date: &args.date,
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
    let is_plain = args.model != Model::Auto
        && args.signal != "auto"
        && !args.signal.contains(',')
        && is_plain(&options);
    let long = Long::of(&args.trials, &columns, is_plain)?;
    let trials = match &long {
        Some(long) => long.beginnings(),
        None => read_trials(&args.trials, Split::Fit, &columns),
    };
    let own = "name the columns of yours with --reference and --signal";
    let trials = trials.map_err(|error| with_columns_to_name(error, own))?;
    // signals that are only candidates may be anything
    let named = [args.reference.as_str(), args.signal.as_str()];
    let (trials, gross_errors) = without_gross_errors(&trials, &named);
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
    let causes = args.causes(&trials, &options)?.without_missing_pressure(&trials, &options);
    options.causes.clone_from(&causes.found);
    let choice = match args.model {
        Model::Auto => Some(choose_model(&trials, &options).map_err(named)?),
        Model::One(_) => None,
    };
    if let Some(choice) = &choice {
        options.model = choice.model;
        detail(format!("chose a model: {}", choice.why));
    }
    let fit = |options: &Options| {
        let fitted = match &long {
            Some(long) => long.calibrate(options),
            None => calibrate(&trials, options),
        };
        fitted.map_err(named)
    };
    let mut calibrated = fit(&options)?;
    detail(format!("fitted {} to {} on {}", options.model, options.reference, options.signal));
    // the passes over a long log report its gross errors themselves
    calibrated.notes.splice(0..0, if long.is_some() { Vec::new() } else { gross_errors });
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
    // nothing is written when a part of what was asked for cannot be
    let fixed = args.fixed.as_ref().map(|path| {
        let record = fixed_record(&calibrated.calibration, &args.adc);
        let made = record.with_context(|| format!("{}: --model {}", path.display(), options.model));
        made.map(|record| (path, record))
    });
    let fixed = fixed.transpose()?;
    let mut outputs = Outputs::default();
    let record = calibration_bytes(&args.out, &calibrated.calibration)?;
    outputs.file(&args.out, |out| out.write_all(&record))?;
    if let Some((path, record)) = &fixed {
        outputs.file(path, |out| out.write_all(&record.bytes))?;
    }
    if let Some(path) = &args.report {
        if let Some(trial) = trials.first().filter(|_| long.is_some() && args.test.is_empty()) {
            let rows = trial.len();
            calibrated.notes.push(format!("the report judges the first {rows} rows of each trial"));
        }
        // the line is the yardstick that every surface is held against
        let linear = fit(&Options { model: ModelKind::Linear, ..options.clone() })?;
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
        if let Some((path, record)) = &fixed {
            let (bytes, read_as) = (record.bytes.len(), &record.read_as);
            tell(format!(
                "wrote {}: {bytes} bytes, a board reads it as {read_as}",
                path.display()
            ))?;
        }
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
