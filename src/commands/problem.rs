//! `stretch init` and `stretch predict`: write a first problem file from recordings, and predict
//! new recordings with a corrected problem.

use std::{path::PathBuf, process::ExitCode};

use anyhow::ensure;
use stretch_data::files::Outputs;
use stretch_problem::{Prediction, Reading, first_problem, predict as predict_new};
use stretch_report::{predict_page, predict_table};

use super::{
    diagnose::announce,
    json::Json,
    shared::{say, say_first, spinner, stage_text, tell, write_text},
};
use crate::display::is_quiet;
use crate::table::table_text;

/// Write a first problem.toml from the recordings in a folder
///
///   stretch init bench
///   stretch diagnose bench/problem.toml
///
/// The file contains the columns with units and ranges, rates, and the trials with a proposed split.
/// Its comments state what was guessed: the inputs of the simulator, and the outputs that are compared.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct InitArgs {
    /// Folder of recordings
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Replace an existing problem.toml
    #[arg(long)]
    force: bool,
}

pub(crate) fn init(args: InitArgs) -> anyhow::Result<()> {
    let path = args.folder.join("problem.toml");
    ensure!(
        args.force || !path.exists(),
        "{}: the file exists; give --force to replace it",
        path.display()
    );
    write_text(&path, &first_problem(&args.folder)?)?;
    tell(format!(
        "wrote {}: read its comments, write the simulator, then run stretch diagnose on it",
        path.display()
    ))
}

/// Status if the error is above `--fail-above`.
const FAILED_ABOVE: u8 = 3;

/// Predict recordings that were not fitted, with and without a fix
///
///   stretch diagnose problem.toml --fix fixed.toml
///   stretch predict fixed.toml friday.csv saturday.csv --report predicted.html
///
/// The simulator runs on the measured inputs of each new recording, once with the fix, and once
/// without its effects but with re-tuned parameters. Errors are root mean squares, in the unit of the
/// output and in multiples of its noise. Columns and rates that leave the fitted ranges are listed,
/// because the prediction cannot be trusted there.
///
/// In continuous integration (exit status 3 if an error is above 5 times the noise of its output):
///
///   stretch predict fixed.toml today.csv --quiet --fail-above 5
///
/// A problem file is a program: its simulator runs with your rights, and is announced before it runs.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct PredictArgs {
    /// Problem file that stretch diagnose --fix wrote
    #[arg(value_name = "fixed.toml")]
    fixed: PathBuf,
    /// New recordings, in any format, at the rate of the old ones
    #[arg(value_name = "NEW", required = true)]
    new: Vec<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Write a report that opens in any browser
    #[arg(long, value_name = "f.html")]
    report: Option<PathBuf>,
    /// Exit with status 3 if the error of an output is above this multiple of its noise
    #[arg(long, value_name = "X")]
    fail_above: Option<f64>,
}

/// Predicts new recordings and returns the exit status.
pub(crate) fn predict(args: PredictArgs) -> anyhow::Result<ExitCode> {
    let is_number = args.fail_above.is_none_or(|most| most.is_finite() && most > 0.0);
    ensure!(is_number, "--fail-above: give a number above 0, in multiples of the noise");
    args.json.share_stdout([args.report.as_deref()])?;
    let bar = spinner();
    bar.set_message("predicting the new recordings");
    let reading = Reading { announce: Some(announce), ..Reading::default() };
    let prediction = predict_new(&args.fixed, &args.new, &reading)?;
    bar.finish_and_clear();
    let mut outputs = Outputs::default();
    if let Some(path) = &args.report {
        stage_text(&mut outputs, path, &predict_page(&prediction))?;
    }
    args.json.conclude(outputs, &prediction, || {
        print(&prediction)?;
        args.report.iter().try_for_each(|path| tell(format!("wrote {}", path.display())))
    })?;
    let is_above = args.fail_above.is_some_and(|most| prediction.largest_times_noise > most);
    Ok(if is_above { ExitCode::from(FAILED_ABOVE) } else { ExitCode::SUCCESS })
}

/// Prints the sentence of the result and, unless the option `-q` is set, all details.
fn print(prediction: &Prediction) -> anyhow::Result<()> {
    say_first(prediction.sentence())?;
    if is_quiet() {
        return Ok(());
    }
    say(table_text(&predict_table(prediction)))?;
    for trial in &prediction.trials {
        for outside in &trial.extrapolated {
            say(format!("{}: {outside}", trial.name))?;
        }
    }
    prediction.notes.iter().try_for_each(|note| say(format!("note: {note}")))
}
