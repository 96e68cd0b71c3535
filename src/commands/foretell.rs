//! `stretch foretell`: what a fixed simulator foretells of recordings that were not fitted.

use std::{path::PathBuf, process::ExitCode};

use anyhow::ensure;
use stretch_files::Outputs;
use stretch_problem::{Foretold, Reading, foretell};
use stretch_report::{foretell_page, foretell_table};

use super::{
    diagnose::announce,
    diagnosis_text::table_text,
    json::Json,
    shared::{say, say_first, spinner, stage_text, tell},
};
use crate::display::is_quiet;

/// Status where the error is above `--fail-above`.
const FAILED_ABOVE: u8 = 3;

/// Foretell recordings that were not fitted, with a fix and without
///
///   stretch diagnose problem.toml --fix fixed.toml
///   stretch foretell fixed.toml friday.csv saturday.csv --report foretold.html
///
/// The simulator runs on the measured inputs of each new recording, once with the effects of the fix
/// and once without any, its parameters re-tuned alone. Errors are root mean squares, in the unit of the
/// output and in multiples of its noise; what goes beyond the ranges and rates that were fitted is said,
/// for there the fix must not be believed.
///
/// In a laboratory's checks (exit status 3 where any output errs by more than 5 times its noise):
///
///   stretch foretell fixed.toml today.csv --quiet --fail-above 5
///
/// A problem file is a program: its simulator runs with your rights, and what runs is said before it runs.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// The problem's file that stretch diagnose --fix wrote
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
    /// Exit with status 3 where an output errs by more than so many times its noise
    #[arg(long, value_name = "X")]
    fail_above: Option<f64>,
    /// Workers of the simulator that run at once, where its file does not say
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    jobs: u16,
}

/// Foretells, and says with which status the program ends.
pub(crate) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let is_number = args.fail_above.is_none_or(|most| most.is_finite() && most > 0.0);
    ensure!(is_number, "--fail-above: give a number above 0, in multiples of the noise");
    args.json.share_stdout([args.report.as_deref()])?;
    let bar = spinner();
    bar.set_message("the new recordings are foretold");
    let reading =
        Reading { jobs: args.jobs.into(), announce: Some(announce), ..Reading::default() };
    let foretold = foretell(&args.fixed, &args.new, &reading)?;
    bar.finish_and_clear();
    let mut outputs = Outputs::default();
    args.json.stage(&mut outputs, &foretold)?;
    if let Some(path) = &args.report {
        stage_text(&mut outputs, path, &foretell_page(&foretold))?;
    }
    outputs.keep()?;
    args.json.say(&foretold, || {
        print(&foretold)?;
        args.report.iter().try_for_each(|path| tell(format!("wrote {}", path.display())))
    })?;
    let is_above = args.fail_above.is_some_and(|most| foretold.worst() > most);
    Ok(if is_above { ExitCode::from(FAILED_ABOVE) } else { ExitCode::SUCCESS })
}

/// The sentence, and everything behind it unless the program is to be quiet.
fn print(foretold: &Foretold) -> anyhow::Result<()> {
    say_first(foretold.sentence())?;
    if is_quiet() {
        return Ok(());
    }
    say(table_text(&foretell_table(foretold)))?;
    for trial in &foretold.trials {
        for unexcited in &trial.unexcited {
            say(format!("{}: {}; do not believe the fix there", trial.name, unexcited.sentence()))?;
        }
    }
    foretold.notes.iter().try_for_each(|note| say(format!("note: {note}")))
}
