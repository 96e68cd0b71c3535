//! The worker `stretch-fmu`: runs an FMU for `stretch`.

use std::{
    fs::File,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use clap::Parser;
use stretch_fmu::{Fmu, FmuSource, Names, ServeError, describe, serve};

/// An FMU (FMI 2 or 3, co-simulation) as a worker of stretch
///
/// It answers frames on standard input with frames on standard output (book/src/reference/worker.md). The program stretch
/// starts it for a problem whose simulator is an fmu.
#[derive(Parser)]
#[command(version)]
struct Args {
    /// The FMU
    #[arg(value_name = "FILE.fmu")]
    file: PathBuf,
    /// Print the beginning of a problem.toml
    #[arg(long)]
    describe: bool,
    /// Name in the FMU of a parameter, an effect or a column
    #[arg(long, value_name = "NAME=VARIABLE", value_parser = pair)]
    variable: Vec<(String, String)>,
    /// Unit of a parameter or an effect in the problem
    #[arg(long, value_name = "NAME=UNIT", value_parser = pair)]
    unit: Vec<(String, String)>,
}

fn pair(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("it is not NAME=VALUE")?;
    Ok((name.to_owned(), value.to_owned()))
}

/// Returns a stream for frames only. Anything that the FMU prints to standard output goes to
/// standard error.
#[cfg(unix)]
fn frames() -> io::Result<File> {
    let own = rustix::io::fcntl_dupfd_cloexec(rustix::stdio::stdout(), 3)?;
    rustix::stdio::dup2_stdout(rustix::stdio::stderr())?;
    Ok(File::from(own))
}

#[cfg(not(unix))]
fn frames() -> io::Result<io::Stdout> {
    Ok(io::stdout())
}

fn run(args: Args) -> Result<(), String> {
    let Args { file, describe: describes, variable, unit } = args;
    if describes {
        let text = describe(&Fmu::open(file).map_err(|e| e.to_string())?);
        return io::stdout().write_all(text.as_bytes()).map_err(|e| e.to_string());
    }
    let names =
        Names { variables: variable.into_iter().collect(), units: unit.into_iter().collect() };
    let to = frames().map_err(|e| format!("standard output: {e}"))?;
    let begin = |session: &_| {
        Fmu::open(&file).and_then(|fmu| FmuSource::new(fmu, Clone::clone(session), &names))
    };
    match serve(io::stdin().lock(), to, begin) {
        Ok(()) => Ok(()),
        // The other side has already received this error and reports it.
        Err(ServeError::Simulator(_)) => std::process::exit(1),
        Err(error) => Err(error.to_string()),
    }
}

fn main() -> ExitCode {
    match run(Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("stretch-fmu: {why}");
            ExitCode::FAILURE
        }
    }
}
