//! `stretch diagnose`: locates the gap between simulator and measurement, names the missing effect,
//! and reports how much of the gap it explains.

use std::{
    io,
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, ensure};
use clap::builder::NonEmptyStringValueParser;
use indicatif::ProgressBar;
use stretch_data::files::{FileError, Outputs};
use stretch_gap::{Answer, Diagnosis, Options, VerdictKind};
use stretch_problem::{ByTrial, Examined, Problem, Reading, in_words};
use stretch_recording::TimeColumn;
use stretch_report::{Subject, diagnosis_page};

use super::{
    diagnosis_output::{print_by_trial, text, write_fix, write_snippets},
    json::Json,
    reading::{Rows, column, columns},
    shared::{detail, doubt, say, say_first, spinner, stage_text, tell},
};
use crate::display::{fail, is_quiet, is_verbose, warn};

/// End of the message if several explanations remain but no experiment is recommended.
const NO_PREDICTION: &str = " that the simulator can predict: it accepts no altered inputs, or its budget of runs is used up";
/// Exit status if the verdict is listed in `--fail-on`.
const FAILED_ON: u8 = 3;
/// Exit status of a diagnosis with fewer simulator runs than requested, because the budget was
/// exhausted.
const SPENT: u8 = 4;

/// Find where simulator and measurement differ, which effect causes it, and how much it explains
///
///   stretch diagnose bench --report gap.html
///
/// DATASET is a folder with dataset.toml and its trials (inlet, outlet, length_mm, bridge_v and, if
/// it was recorded, pressure_kpa), or, for a gauge alone, one trial or such a folder without inlet
/// and outlet; its columns are length_mm and bridge_v unless they are named:
///
///   stretch diagnose knit.csv --reference angle_deg --signal s2
///
/// The named effects can be written into a rig file, with which the gap is closed, and as code for
/// your own simulator:
///
///   stretch diagnose bench --fix fixed.toml --snippets code
///   stretch diagnose bench --rig fixed.toml
///
/// Your own simulator, in any language, is described in a problem.toml with its parameters, the
/// recordings, and the effects that may be added to it (stretch init FOLDER writes a first one):
///
///   stretch diagnose problem.toml --fix fixed.toml
///   stretch diagnose fixed.toml
///
/// A problem file is a program: its simulator runs with your rights. It runs only if the file itself
/// is named, not its folder, and the command is printed before it runs. The keys jobs and budget of
/// the file set how many workers run at once, and how many runs are made at most (exit status 4 if
/// the budget is used up).
///
/// For regular checks that a rig still agrees with its simulator (exit status 3 if it does not):
///
///   stretch diagnose bench --rig fixed.toml --quiet --fail-on gap
///
/// Test trials are used once, at the end. Without --rig the simulator is the rig file that the data
/// set names, else the stock rig. Its parameters may be re-tuned within their tolerances; its effects
/// are kept.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder with dataset.toml, a trial in any format, - for standard input, or problem.toml
    #[arg(value_name = "DATASET")]
    data_set: PathBuf,
    /// Rig file of the simulator
    ///
    /// Nominal parameters with their tolerances, and the effects that the simulator already has.
    #[arg(long, value_name = "rig.toml")]
    rig: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Write a report that opens in any browser
    #[arg(long, value_name = "d.html")]
    report: Option<PathBuf>,
    /// Write a corrected rig or problem file
    ///
    /// Parameters are re-tuned and the found effects are added; an existing file is replaced.
    #[arg(long, value_name = "fixed.toml")]
    fix: Option<PathBuf>,
    /// Write the joint distribution of the parameters
    ///
    /// For domain randomisation: JSON that YAML readers take as well.
    #[arg(long, value_name = "ranges.json")]
    ranges: Option<PathBuf>,
    /// Write code of each named effect into a new folder
    ///
    /// In C, Python and MATLAB.
    #[arg(long, value_name = "DIR")]
    snippets: Option<PathBuf>,
    /// Time column; COL:ms if in ms; 100hz if there is none
    #[arg(long, value_name = "COL")]
    time: Option<TimeColumn>,
    /// Do not consider this effect; can be repeated
    #[arg(long, value_name = "EFFECT")]
    without: Vec<String>,
    #[command(flatten)]
    rows: Rows,
    /// Reference column of a gauge alone
    ///
    /// Or the quantity that an output of your own simulator senses.
    #[arg(long, value_name = "COLUMN", requires = "signal", value_parser = column)]
    reference: Option<String>,
    /// Signal column of a gauge alone
    ///
    /// Several signals of one recorder are separated by commas. With your own simulator, this is the output.
    #[arg(long, value_name = "COLUMN", requires = "reference", value_parser = columns)]
    signal: Option<String>,
    /// Write the recommended experiment as a trial file
    #[arg(long, value_name = "next.csv")]
    experiment: Option<PathBuf>,
    /// Do not search for an experiment that would distinguish competing effects
    #[arg(long, hide = true, conflicts_with = "experiment")]
    no_next: bool,
    /// Also fit each run separately, and report which disagree
    ///
    /// A run is a trial or, with the name of a column, all samples in which this column has the same value, such as a load. The
    /// output also lists in which parameters the runs disagree, and which values the data determine.
    #[arg(long, value_name = "trial|COLUMN", value_parser = NonEmptyStringValueParser::new())]
    by: Option<String>,
    /// Exit with status 3 for these verdicts: gap, any, ...
    ///
    /// Several are separated by commas: effect (an effect explains the gap or a part of it), unknown (no effect explains the gap or
    /// a part of it), record (a column or the rig file is wrong), faint (above the noise, but too small to name a cause),
    /// parameters (agreement after re-tuning), gap (effect, unknown or record, or agreement with reservations), any (everything
    /// except plain agreement).
    #[arg(
        long,
        value_name = "VERDICT",
        value_enum,
        value_delimiter = ',',
        hide_possible_values = true
    )]
    fail_on: Vec<FailOn>,
}

/// What `stretch diagnose --fail-on` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum FailOn {
    Effect,
    Unknown,
    Record,
    Faint,
    Parameters,
    Gap,
    Any,
}

impl FailOn {
    /// Whether a diagnosis matches this option.
    fn covers(self, diagnosis: &Diagnosis) -> bool {
        use VerdictKind::{Effect, NoGap, Parameters, Partial, Record, Unknown};
        let verdict = diagnosis.verdict();
        let is_faint = matches!(diagnosis.answer, Answer::Faint { .. });
        match self {
            // A partial answer names an effect, and a part of the gap remains unexplained.
            Self::Effect => matches!(verdict, Effect | Partial),
            Self::Unknown => matches!(verdict, Unknown | Partial),
            Self::Record => verdict == Record,
            Self::Faint => is_faint,
            Self::Parameters => verdict == Parameters,
            // A fault of the recording may hide a gap, so the result does not count as agreement.
            Self::Gap => !diagnosis.is_agreement(),
            Self::Any => verdict != NoGap || is_faint || !diagnosis.is_agreement(),
        }
    }
}

/// Runs the diagnosis and returns the exit status.
pub(crate) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let fail_on = args.fail_on.clone();
    let diagnosis = diagnosed(args)?;
    let is_failure = fail_on.iter().any(|on| on.covers(&diagnosis));
    let is_spent = diagnosis.model_runs.is_some_and(|runs| runs.is_spent);
    Ok(match is_failure {
        true => ExitCode::from(FAILED_ON),
        false if is_spent => ExitCode::from(SPENT),
        false => ExitCode::SUCCESS,
    })
}

fn diagnosed(args: Args) -> anyhow::Result<Diagnosis> {
    let is_there = args.data_set.as_os_str() == "-" || args.data_set.exists();
    let files =
        [&args.report, &args.fix, &args.ranges, &args.experiment].map(|path| path.as_deref());
    args.json.share_stdout(files)?;
    ensure!(is_there, "{}: there is no such file or folder", args.data_set.display());
    if let Some(folder) = args.snippets.as_deref().filter(|folder| folder.exists()) {
        let is_empty = std::fs::read_dir(folder).is_ok_and(|mut held| held.next().is_none());
        ensure!(is_empty, FileError::Exists { path: folder.display().to_string() });
    }
    let options = Options { responses: args.report.is_some(), ..Options::default() };
    let bar = spinner();
    bar.set_message("reading, and starting your own simulator if there is one");
    let shown = || args.data_set.display().to_string();
    let recorded = args.time.as_ref().map(TimeColumn::options);
    let reading = Reading {
        recorded: recorded.as_ref(),
        strict: args.rows.strict,
        rig: args.rig.as_deref(),
        columns: args.reference.as_deref().zip(args.signal.as_deref()),
        by: args.by.as_deref().filter(|by| *by != "trial"),
        without: &args.without,
        announce: Some(announce),
    };
    let problem = open(&args.data_set, &reading)?;
    // The rig file or the data may be the cause of an error, so messages name both.
    let beside = || match &args.rig {
        Some(rig) => format!("{} with {}", shown(), rig.display()),
        None => shown(),
    };
    detail(format!("read {}", beside()));
    // If simulator runs are limited, the next experiment is searched for only on request.
    let looks_on = match problem.simulator().model_runs() {
        Some(_) => args.experiment.is_some(),
        None => !args.no_next,
    };
    let stop = &|| false;
    let examined =
        problem.examine(&options, looks_on, &told_on(&bar), stop).with_context(beside)?;
    let by_trial = args.by.as_deref().map(|by| match by {
        "trial" => problem.by_trial(&examined, &told_on(&bar), stop),
        name => problem.by_column(name, &examined, &told_on(&bar), stop),
    });
    let by_trial = by_trial.transpose().with_context(|| format!("{}: --by", shown()))?;
    bar.finish_and_clear();
    conclude(&args, (&examined, by_trial.as_ref()), &problem)?;
    Ok(examined.diagnosis)
}

/// Reads a problem. Errors name its path exactly once.
pub(super) fn open(path: &Path, reading: &Reading<'_>) -> anyhow::Result<Problem> {
    Problem::read(path, reading).map_err(|error| {
        let shown = path.display().to_string();
        // Errors of a problem file already name that file.
        let is_named = error.to_string().starts_with(&shown);
        let error = anyhow::Error::from(error);
        if is_named { error } else { error.context(shown) }
    })
}

/// Announces the program that is going to run.
pub(super) fn announce(program: &str) {
    warn(program);
}

/// Returns a function that shows progress: on a bar, and with `-v` in lines.
pub(super) fn told_on(bar: &ProgressBar) -> impl Fn(&str) + Sync {
    move |what| {
        detail(what);
        bar.set_message(what.to_owned());
    }
}

/// Writes all files or none. Prints afterwards, because the messages name the files that were written.
fn conclude(
    args: &Args,
    (examined, by_trial): (&Examined, Option<&ByTrial>),
    problem: &Problem,
) -> anyhow::Result<()> {
    let (mut said, mut missing, mut outputs) = (Vec::new(), Vec::new(), Outputs::default());
    match (&args.experiment, &examined.experiment) {
        (Some(path), Some(trial)) => {
            trial.check()?;
            outputs.file(path, |out| trial.write_to(out).map_err(io::Error::other))?;
            said.push(format!("wrote {}", path.display()));
        }
        // This is an error message, because a script may expect the file.
        (Some(path), None) => missing.push(format!(
            "{} is not written: no experiment is recommended, because there are no competing effects to distinguish{}",
            path.display(),
            if examined.diagnosis.ambiguous.len() > 1 { NO_PREDICTION } else { "" }
        )),
        _ => {}
    }
    let mut answer = examined.to_json();
    if let Some(by_trial) = by_trial {
        answer["by_trial"] = serde_json::to_value(by_trial)?;
    }
    if let Some(path) = &args.report {
        let page = diagnosis_page(&Subject::of(problem, examined).by_trial(by_trial));
        stage_text(&mut outputs, path, &page)?;
        said.push(format!("wrote {}", path.display()));
    }
    if let Some(path) = &args.fix {
        said.push(write_fix(&mut outputs, path, examined)?);
    }
    match (&args.ranges, &examined.ranges) {
        (Some(path), Ok(ranges)) => {
            stage_text(&mut outputs, path, &ranges.to_text())?;
            said.push(format!("wrote {}", path.display()));
        }
        (Some(path), Err(why)) => missing.push(format!("{} is not written: {why}", path.display())),
        _ => {}
    }
    if let Some(folder) = &args.snippets {
        said.push(write_snippets(&mut outputs, folder, &examined.implementations)?);
    }
    args.json.conclude(outputs, &answer, || {
        print(examined)?;
        by_trial.iter().try_for_each(|by_trial| print_by_trial(by_trial))?;
        said.iter().try_for_each(tell)
    })?;
    missing.iter().for_each(fail);
    Ok(())
}

/// Prints the sentence of the result and, unless the option `-q` is set, all details.
pub(super) fn print(examined: &Examined) -> anyhow::Result<()> {
    // With `-v`, effects have the names that are used in files and options.
    let diagnosis = match is_verbose() {
        true => &examined.diagnosis,
        false => &in_words(&examined.diagnosis),
    };
    diagnosis.reservations().for_each(doubt);
    say_first(&diagnosis.sentence)?;
    if is_quiet() {
        return Ok(());
    }
    say(text(diagnosis, &examined.implementations, is_verbose()))
}
