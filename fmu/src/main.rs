//! The worker `stretch-fmu`: runs an FMU for `stretch`.

use std::{
    fs::File,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use stretch_fmu::{Fmu, FmuSource, Names, ServeError, describe, serve};

const USAGE: &str = "\
An FMU (FMI 2 or 3, co-simulation) as a worker of stretch.

stretch-fmu FILE.fmu [--variable NAME=VARIABLE]... [--unit NAME=UNIT]...
    answers frames on standard input with frames on standard output (book/src/reference/worker.md);
    stretch starts it for a problem whose simulator is an fmu
    --variable  what a parameter, an effect or a column is called in the FMU
    --unit      unit of a parameter or an effect in the problem

stretch-fmu --describe FILE.fmu
    prints the beginning of a problem.toml
";

/// The requested action.
enum Asked {
    Help,
    Describe(PathBuf),
    Serve(PathBuf, Names),
}

fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Asked, String> {
    let (mut file, mut names, mut describes) = (None, Names::default(), false);
    while let Some(argument) = arguments.next() {
        let mut pair = |into: &mut std::collections::BTreeMap<String, String>| {
            let pair = arguments.next().ok_or_else(|| format!("{argument} needs NAME=VALUE"))?;
            let (name, value) =
                pair.split_once('=').ok_or_else(|| format!("{pair:?} is not NAME=VALUE"))?;
            into.insert(name.to_owned(), value.to_owned());
            Ok::<(), String>(())
        };
        match argument.as_str() {
            "--help" | "-h" => return Ok(Asked::Help),
            "--describe" => describes = true,
            "--variable" => pair(&mut names.variables)?,
            "--unit" => pair(&mut names.units)?,
            option if option.starts_with("--") => {
                return Err(format!("there is no option {option}\n\n{USAGE}"));
            }
            _ if file.is_some() => return Err(format!("{argument}: one FMU is enough\n\n{USAGE}")),
            _ => file = Some(PathBuf::from(argument)),
        }
    }
    let file = file.ok_or_else(|| format!("give an FMU\n\n{USAGE}"))?;
    Ok(if describes { Asked::Describe(file) } else { Asked::Serve(file, names) })
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

fn run() -> Result<(), String> {
    match parse(std::env::args().skip(1))? {
        Asked::Help => print(USAGE),
        Asked::Describe(file) => print(&describe(&Fmu::open(file).map_err(|e| e.to_string())?)),
        Asked::Serve(file, names) => {
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
    }
}

fn print(text: &str) -> Result<(), String> {
    io::stdout().write_all(text.as_bytes()).map_err(|e| e.to_string())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("stretch-fmu: {why}");
            ExitCode::FAILURE
        }
    }
}
