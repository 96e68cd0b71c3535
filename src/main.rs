//! The `stretch` program: parse, dispatch.

// these panic where nobody reads: `display` has what is said
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod commands;
mod display;
mod paper;
mod table;
mod terminal;

use std::{io::ErrorKind, process::ExitCode};

use clap::{CommandFactory, Parser, Subcommand, error::ErrorKind as ArgumentError};

use commands::{
    apply, calibrate, completions, convert, demo, diagnose, effects, evaluate, export, fleet,
    foretell, init, json, listen, man, page, prior, record, renew, rig, simulate,
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
/// and live, a line a sample:  logger | stretch apply --calibration cal.json -
///
/// No data at hand? `stretch demo` simulates the paper's experiment, calibrates,
/// judges, says why simulator and rig disagree, and writes one report;
/// `stretch demo --data DIR` does the same on measured sessions.
#[derive(Parser)]
#[command(name = "stretch", version, verbatim_doc_comment, max_term_width = 100, after_help = STATUSES)]
struct Cli {
    /// Say nothing but results and errors; of a diagnosis say the verdict alone
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say also what is read and chosen, and how long it takes, on standard error; say every detail of a diagnosis
    #[arg(short, long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Command,
}

/// The part of the help that holds for all commands.
const STATUSES: &str = "\
Where a file is read or written, - is standard input or output.

Exit status:
  0    done
  1    not done: standard error says why, and nothing is half-written
  2    the arguments are not understood
  3    done, and the verdict of `stretch diagnose` is one that --fail-on names, or an error of
       `stretch foretell` is above --fail-above
  4    done as far as the --budget of `stretch diagnose` lasted: what was found until then is the answer
  130  ended by Ctrl-C";

#[derive(Subcommand)]
enum Command {
    Calibrate(Box<calibrate::Args>),
    Prior(prior::Args),
    Renew(renew::Args),
    Apply(apply::Args),
    Evaluate(evaluate::Args),
    Convert(convert::Args),
    Demo(demo::Args),
    Simulate(simulate::Args),
    Diagnose(diagnose::Args),
    Foretell(foretell::Args),
    Init(init::Args),
    Effects(effects::Args),
    Rig(rig::Args),
    Listen(listen::Args),
    Export(export::Args),
    Page(page::Args),
    Record(record::Args),
    Completions(completions::Args),
    Man(man::Args),
    Fleet(fleet::Args),
}

/// Exit status after Ctrl-C.
const INTERRUPTED: u8 = 130;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(answer) => return explain(&answer),
    };
    // Without a handler Ctrl-C still ends the program; only the cleaning up is lost.
    let _ = ctrlc::set_handler(|| commands::stop::on_ctrl_c(INTERRUPTED));
    display::begin(match (cli.quiet, cli.verbose) {
        (true, _) => Volume::Quiet,
        (_, true) => Volume::Verbose,
        _ => Volume::Usual,
    });
    let mut done = ExitCode::SUCCESS;
    let result = match cli.command {
        Command::Calibrate(args) => calibrate::run(*args),
        Command::Prior(args) => prior::run(args),
        Command::Renew(args) => renew::run(args),
        Command::Apply(args) => apply::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Convert(args) => convert::run(args),
        Command::Demo(args) => demo::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Diagnose(args) => diagnose::run(args).map(|status| done = status),
        Command::Foretell(args) => foretell::run(args).map(|status| done = status),
        Command::Init(args) => init::run(args),
        Command::Effects(args) => effects::run(args),
        Command::Rig(args) => rig::run(args),
        Command::Listen(args) => listen::run(args),
        Command::Export(args) => export::run(args),
        Command::Page(args) => page::run(args),
        Command::Record(args) => record::run(args),
        Command::Completions(args) => completions::run(&args, Cli::command()),
        Command::Man(args) => man::run(&args, Cli::command()),
        Command::Fleet(args) => fleet::run(args),
    };
    display::detail("the end");
    // whoever read our output has gone: nothing is wrong
    let is_unread = display::lost() == Some(ErrorKind::BrokenPipe);
    match (result, display::lost()) {
        (Err(_), _) if stretch_files::interrupted() => ExitCode::from(INTERRUPTED),
        (Err(error), _) if is_unread && is_broken_pipe(&error) => ExitCode::SUCCESS,
        (Err(error), _) => {
            display::fail(message(&error));
            ExitCode::FAILURE
        }
        (Ok(()), Some(kind)) if !is_unread => {
            let files = "what was to be written into files is";
            display::fail(format!("standard output took not all: {kind}; {files}"));
            ExitCode::FAILURE
        }
        (Ok(()), _) => done,
    }
}

/// Help that was asked for, or what is wrong with the arguments.
fn explain(answer: &clap::Error) -> ExitCode {
    let is_surplus =
        matches!(answer.kind(), ArgumentError::UnknownArgument | ArgumentError::TooManyValues);
    let arguments: Vec<String> =
        std::env::args_os().map(|argument| argument.to_string_lossy().into_owned()).collect();
    if let Some(meant) = json::meant_a_file(&arguments).filter(|_| is_surplus) {
        display::fail(meant);
        return ExitCode::from(2);
    }
    let is_command = answer.kind() == ArgumentError::InvalidSubcommand;
    if is_command && arguments.get(1).is_some_and(|command| command == "blind") {
        display::fail(
            "the blind check is a program of its own: cargo run --release --manifest-path challenge/Cargo.toml -- --cases 100",
        );
        return ExitCode::from(2);
    }
    match answer.print() {
        _ if answer.use_stderr() => ExitCode::from(2),
        Err(error) if error.kind() != ErrorKind::BrokenPipe => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    }
}

/// The error and its causes as one sentence; a cause that the sentence
/// already contains is left out.
fn message(error: &anyhow::Error) -> String {
    let mut text = without_numbers(&error.to_string());
    for cause in error.chain().skip(1).map(|cause| without_numbers(&cause.to_string())) {
        if cause.starts_with(&format!("{text}:")) {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    stretch_files::without_temporary_names(&text)
}

/// A text without Rust's `(os error 28)`, which says what stands before it again.
fn without_numbers(text: &str) -> String {
    let mut parts = text.split(" (os error ");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text += part.split_once(')').map_or(part, |(_, rest)| rest);
    }
    text
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
    })
}
