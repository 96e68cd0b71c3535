//! The program `stretch`: parses its arguments and runs a command. This crate is not meant as a
//! library; use the crates on which it is built.

// `print!` and `eprint!` panic if the reader of the stream has closed it. Use the functions of `display` instead.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod commands;
mod display;
mod old_names;
mod outputs;
mod paper;
mod table;

use std::{io::ErrorKind, process::ExitCode};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand, error::ErrorKind as ArgumentError};

use commands::{
    apply, calibrate, compare, convert, demo, diagnose, effects, evaluate, export, json, listen,
    page, plan, problem, simulate, sleeve,
};
use display::Volume;

/// From the voltage of a stretch sensor to length, live.
///
/// A first session with logged trials (CSV, a header line, a time_s column):
///
///   stretch calibrate ramp_1.csv ramp_2.csv --out cal.json --report cal.html
///   stretch evaluate --calibration cal.json another.csv
///   stretch apply --calibration cal.json another.csv --out estimate.csv
///
/// and live, one line per sample:  logger | stretch apply --calibration cal.json -
///
/// No data at hand? `stretch demo` simulates the paper's experiment, calibrates,
/// evaluates, finds why simulator and rig disagree, and writes one report;
/// `stretch demo --data DIR` does the same on measured sessions.
#[derive(Parser)]
#[command(name = "stretch", version, verbatim_doc_comment, max_term_width = 100, after_help = STATUSES)]
struct Cli {
    /// Print only results, doubts about them, and errors
    ///
    /// For a diagnosis, a calibration or an evaluation, print only its sentence.
    #[arg(short, long, global = true, conflicts_with = "verbose", display_order = 900)]
    quiet: bool,
    /// Also print what is read and chosen
    ///
    /// With times, on standard error. For a diagnosis, print all details.
    #[arg(short, long, global = true, display_order = 901)]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

/// The part of the help that applies to all commands.
const STATUSES: &str = "\
For a file that is read or written, - means standard input or output.

Exit status:
  0    done
  1    not done: standard error gives the reason, and no output is half-written
  2    the arguments are not understood
  3    done, and the verdict of `stretch diagnose` is one that --fail-on names, or an error of
       `stretch predict` is above --fail-above
  4    done, but the budget of the problem file ran out: the result is what was found until then
  130  ended by Ctrl-C";

#[derive(Subcommand)]
enum Command {
    Calibrate(Box<calibrate::Args>),
    Sleeve(sleeve::Args),
    Apply(apply::Args),
    Evaluate(evaluate::Args),
    Convert(convert::Args),
    Compare(compare::Args),
    Demo(demo::Args),
    Simulate(simulate::Args),
    Diagnose(diagnose::Args),
    Predict(problem::PredictArgs),
    Init(problem::InitArgs),
    Plan(plan::PlanArgs),
    Rehearse(plan::RehearseArgs),
    Effects(effects::Args),
    Listen(listen::Args),
    Export(export::Args),
    Page(page::Args),
}

/// Exit status after Ctrl-C.
const INTERRUPTED: u8 = 130;

/// Returns the commands and options, for man pages and shell completions.
pub fn command() -> clap::Command {
    with_paragraphs(Cli::command())
}

/// Joins the lines of each paragraph of a command's text, and of the commands below it, because clap
/// breaks lines at the width of the terminal.
fn with_paragraphs(mut command: clap::Command) -> clap::Command {
    if let Some(text) = command.get_about().map(|text| paragraphs(&text.to_string())) {
        command = command.about(text);
    }
    if let Some(text) = command.get_long_about().map(|text| paragraphs(&text.to_string())) {
        command = command.long_about(text);
    }
    command.mut_subcommands(with_paragraphs)
}

/// Joins consecutive lines. Indented lines, which are examples, stay as they are.
fn paragraphs(text: &str) -> String {
    let is_prose = |line: &str| !line.is_empty() && !line.starts_with(' ');
    let mut joined = String::new();
    let mut continues = false;
    for line in text.lines() {
        if !joined.is_empty() {
            joined.push(if continues && is_prose(line) { ' ' } else { '\n' });
        }
        joined += line;
        continues = is_prose(line);
    }
    joined
}

/// Runs the program with the arguments of the process.
pub fn run() -> ExitCode {
    let mut command = command();
    let arguments = old_names::with_todays_names(std::env::args_os());
    let parsed = command.try_get_matches_from_mut(arguments).and_then(|matches| {
        let cli = Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
        Ok((cli, outputs::guard(&command, &matches)))
    });
    let (cli, guarded) = match parsed {
        Ok(parsed) => parsed,
        Err(answer) => return explain(&answer),
    };
    // If the handler cannot be set, Ctrl-C still ends the program, but temporary files are not removed.
    let _ = ctrlc::set_handler(|| commands::shared::on_ctrl_c(INTERRUPTED));
    display::begin(match (cli.quiet, cli.verbose) {
        (true, _) => Volume::Quiet,
        (_, true) => Volume::Verbose,
        _ => Volume::Usual,
    });
    stretch_gap::cap_threads();
    let mut done = ExitCode::SUCCESS;
    let result = guarded.and_then(|()| match cli.command {
        Command::Calibrate(args) => calibrate::run(*args),
        Command::Sleeve(args) => sleeve::run(args),
        Command::Apply(args) => apply::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Demo(args) => demo::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Diagnose(args) => diagnose::run(args).map(|status| done = status),
        Command::Predict(args) => problem::predict(args).map(|status| done = status),
        Command::Init(args) => problem::init(args),
        Command::Plan(args) => plan::run(args),
        Command::Rehearse(args) => plan::run_rehearsal(args),
        Command::Effects(args) => effects::run(args),
        Command::Listen(args) => listen::run(args),
        Command::Export(args) => export::run(args),
        Command::Page(args) => page::run(args),
    });
    display::detail("the end");
    // It is not an error if the reader of standard output has closed it, as `head` does.
    let is_unread = display::lost() == Some(ErrorKind::BrokenPipe);
    match (result, display::lost()) {
        (Err(error), _) if is_unread && is_broken_pipe(&error) => ExitCode::SUCCESS,
        (Err(error), _) => {
            display::fail(stretch_data::error_sentence(error.as_ref()));
            ExitCode::FAILURE
        }
        (Ok(()), Some(kind)) if !is_unread => {
            let files = "the output files are complete";
            display::fail(format!(
                "standard output could not be written completely: {kind}; {files}"
            ));
            ExitCode::FAILURE
        }
        (Ok(()), _) => done,
    }
}

/// Prints the requested help, or the error in the arguments, and returns the exit status.
fn explain(answer: &clap::Error) -> ExitCode {
    let is_surplus =
        matches!(answer.kind(), ArgumentError::UnknownArgument | ArgumentError::TooManyValues);
    let arguments: Vec<String> =
        std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect();
    if let Some(meant) = json::meant_a_file(&arguments).filter(|_| is_surplus) {
        display::fail(meant);
        return ExitCode::from(2);
    }
    if let Some(instead) = old_names::instead(answer) {
        display::fail(instead);
        return ExitCode::from(2);
    }
    match answer.print() {
        _ if answer.use_stderr() => ExitCode::from(2),
        Err(error) if error.kind() != ErrorKind::BrokenPipe => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
    })
}
