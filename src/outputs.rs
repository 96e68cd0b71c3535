//! The options that name outputs, and checks of their paths before a command begins.

use std::{
    any::TypeId,
    fs::File,
    io::Read,
    path::{Path, PathBuf},
};

use anyhow::ensure;
use clap::{Arg, ArgMatches, Command};
use stretch_data::files::guard_inputs;

/// Options whose paths are written. All other paths are read.
const OUTPUTS: [&str; 10] =
    ["c", "experiment", "fix", "fixed", "json", "out", "ranges", "report", "session", "snippets"];

/// Returns the long name of an option whose value is a path.
fn option(argument: &Arg) -> Option<&str> {
    let is_path = argument.get_value_parser().type_id() == TypeId::of::<PathBuf>();
    argument.get_long().filter(|_| is_path)
}

/// An output given on the command line.
struct Output {
    option: String,
    path: PathBuf,
    /// Example of such a file name in the help: `cal.json`.
    example: String,
    /// Whether an existing file that looks like a recording may be replaced, because the command
    /// may have written it itself.
    replaces_recordings: bool,
}

fn named(command: &Command, matches: &ArgMatches, found: &mut Vec<Output>) {
    for argument in command.get_arguments() {
        let Some(name) = option(argument).filter(|name| OUTPUTS.contains(name)) else { continue };
        let example = argument.get_value_names().unwrap_or_default().concat();
        let id = argument.get_id().as_str();
        let paths = matches.get_many::<PathBuf>(id).into_iter().flatten();
        let places = matches.indices_of(id).into_iter().flatten();
        found.extend(paths.zip(places).map(|(path, place)| Output {
            option: format!("--{name}"),
            path: path.clone(),
            example: example.clone(),
            replaces_recordings: match command.get_name() {
                // Rows of estimates contain words, so an earlier output is not mistaken for a recording.
                "apply" => false,
                // If a file name follows the output on the command line, a shell may have expanded --out *.csv.
                "convert" => !is_at(command, matches, place + 1),
                _ => true,
            },
        }));
    }
    if let Some((name, matches)) = matches.subcommand()
        && let Some(command) = command.find_subcommand(name)
    {
        named(command, matches, found);
    }
}

/// Whether a positional argument has this place on the command line.
fn is_at(command: &Command, matches: &ArgMatches, place: usize) -> bool {
    let indices = |argument: &Arg| matches.indices_of(argument.get_id().as_str());
    command.get_positionals().filter_map(indices).flatten().any(|index| index == place)
}

/// Guards the inputs of a command against being overwritten by its outputs.
///
/// # Errors
/// Two outputs that are the same file; an output that would replace a recording. For example, a shell expands `--out
/// r*.csv` to the names of existing recordings, and the first name becomes the output.
pub(crate) fn guard(command: &Command, matches: &ArgMatches) -> anyhow::Result<()> {
    let mut outputs = Vec::new();
    named(command, matches, &mut outputs);
    for Output { option, path, example, replaces_recordings } in &outputs {
        let ending = Path::new(example).extension();
        let is_expected = ending.is_some() && path.extension() == ending;
        let such_as = ending.map_or(String::new(), |_| format!(", such as {example}"));
        ensure!(
            (*replaces_recordings && (is_expected || example.contains(".csv")))
                || !is_recording(path),
            "{option} {}: this file is a recording and is not overwritten; name another file{such_as}, or remove this one first (a shell \
             expands {option} *.csv to the names of all recordings)",
            path.display()
        );
    }
    Ok(guard_inputs(outputs.into_iter().map(|output| (output.option, output.path)))?)
}

/// Whether a file begins with rows of numbers, or contains zero bytes and is therefore binary.
fn is_recording(path: &Path) -> bool {
    let mut head = Vec::new();
    let is_file = path.is_file();
    if !is_file
        || File::open(path).and_then(|file| file.take(1 << 14).read_to_end(&mut head)).is_err()
    {
        return false;
    }
    let text = String::from_utf8_lossy(&head);
    let is_row = |line: &&str| {
        let fields = || line.split([',', ';', '\t', ' ']).filter(|field| !field.is_empty());
        fields().count() > 1 && fields().all(|field| field.trim().parse::<f64>().is_ok())
    };
    head.contains(&0) || text.lines().filter(is_row).nth(1).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Options whose paths are read.
    const INPUTS: [&str; 6] = ["calibration", "data", "from", "prior", "rig", "test"];

    fn paths(command: &Command, found: &mut Vec<String>) {
        found.extend(command.get_arguments().filter_map(option).map(str::to_owned));
        command.get_subcommands().for_each(|command| paths(command, found));
    }

    /// `convert` replaces its own earlier output, but not a recording whose name may come from the expansion of a
    /// pattern by the shell.
    #[test]
    fn a_converted_recording_is_replaced_by_the_same_command() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name).display().to_string();
        let (log, trial) = (path("log.csv"), path("trial.csv"));
        for file in [&log, &trial] {
            std::fs::write(file, "time_s,length_mm\n0,1\n1,2\n2,3\n").expect("a recording");
        }
        let guarded = |words: &[&str]| {
            let command = crate::command();
            let words = std::iter::once("stretch").chain(words.iter().copied());
            let matches = command.clone().try_get_matches_from(words).expect("a command line");
            guard(&command, &matches)
        };
        assert!(guarded(&["convert", &log, "--out", &trial]).is_ok());
        assert!(guarded(&["convert", &log, "--out", &trial, "--grid", "50"]).is_ok());
        for refused in [
            &["convert", "--out", &trial, &log][..],
            &["apply", &log, "--calibration", "c.json", "--out", &trial],
        ] {
            let error = guarded(refused).expect_err("a recording").to_string();
            assert!(error.contains("this file is a recording and is not overwritten"), "{error}");
        }
    }

    #[test]
    fn every_option_with_a_path_is_known_as_one_that_is_read_or_written() {
        let mut found = Vec::new();
        paths(&crate::command(), &mut found);
        found.sort();
        found.dedup();
        let mut known = [&OUTPUTS[..], &INPUTS].concat();
        known.sort_unstable();
        assert_eq!(found, known);
    }
}
