//! Commands and options of earlier releases and their replacements.

use std::ffi::{OsStr, OsString};

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Removed commands, each with a sentence on the replacement.
const COMMANDS: [(&str, &str); 9] = [
    (
        "blind",
        "the blind check is a separate program: cargo run --release -p stretch-challenge -- --cases 100",
    ),
    (
        "completions",
        "shell completions come with a release, in the folder completions; cargo run --example manual -- FOLDER writes them",
    ),
    (
        "fleet",
        "lakes of trials have a separate program, stretch-fleet: cargo build --release -p stretch-fleet-program",
    ),
    ("foretell", "this command is called predict now: stretch predict fixed.toml NEW"),
    (
        "man",
        "man pages come with a release, in the folder man1; cargo run --example manual -- FOLDER writes them",
    ),
    ("prior", "write stretch sleeve learn"),
    (
        "record",
        "write stretch export --calibration cal.json to check a calibration file, and add --seal to renew its checksum",
    ),
    ("renew", "write stretch sleeve renew"),
    ("rig", "write stretch simulate --print-rig"),
];

/// Removed options, each with a sentence on the replacement.
const OPTIONS: [(&str, &str); 21] = [
    ("--adc-bits", "write --adc BITS,ZERO,FULL_SCALE"),
    ("--adc-zero-v", "write --adc BITS,ZERO,FULL_SCALE"),
    ("--adc-full-scale-v", "write --adc BITS,ZERO,FULL_SCALE"),
    (
        "--allow-commands",
        "name the problem.toml itself instead of its folder, which allows its simulator to run",
    ),
    ("--baud", "write the speed after the port: --port PATH:BAUD"),
    ("--branch-by", "--rate paper selects the complete published method"),
    ("--budget", "write budget = N into the problem's file"),
    ("--commands", "write --protocol TRIAL.csv"),
    ("--dead-band", "the dead band is always three standard deviations of the rate's noise"),
    ("--depth", "a diagnosis names up to four effects"),
    ("--figure", "the printed table contains the same numbers"),
    ("--fixed", "write stretch export --calibration cal.json --fixed FILE"),
    ("--grid", "resample first: stretch convert LOG --grid HZ --out TRIAL.csv"),
    ("--jobs", "write jobs = N below [simulator] in the problem's file"),
    ("--kinds", "write stretch effects kinds"),
    ("--normalise", "channels are always divided by their range"),
    ("--paper", "write stretch calibrate --rate paper, or stretch demo --paper"),
    ("--rate-source", "--rate paper selects the complete published method"),
    ("--sessions", "write --data FOLDER/GROUP"),
    ("--threads", "set RAYON_NUM_THREADS=N in the environment; the result is the same for every N"),
    ("--time-unit", "write --time COL:UNIT, such as --time stamp:us"),
];

/// Renamed options and their new spelling, because old scripts still use them. The value of the option is inserted
/// between the two texts.
const RENAMED: [(&str, [&str; 2]); 4] = [
    ("--json-out", ["--json=", ""]),
    ("--preset", ["--rig=", ""]),
    ("--sample-rate", ["--time=", "hz"]),
    ("--signals", ["--signal=", ""]),
];

/// Replaces renamed options by their present names.
pub(crate) fn with_todays_names(mut arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut renamed = Vec::new();
    while let Some(argument) = arguments.next() {
        let text = argument.to_string_lossy().into_owned();
        let (name, value) = text.split_once('=').map_or((&*text, None), |(n, v)| (n, Some(v)));
        if let Some((_, [before, after])) = RENAMED.iter().find(|(old, _)| *old == name) {
            let value = value.map(OsString::from).or_else(|| arguments.next()).unwrap_or_default();
            renamed.push([OsStr::new(before), &*value, OsStr::new(after)].into_iter().collect());
            continue;
        }
        renamed.push(argument);
        if text == "--" {
            break;
        }
    }
    renamed.extend(arguments);
    renamed
}

/// If the error is about a removed command or option, returns a sentence on its replacement.
pub(crate) fn instead(error: &clap::Error) -> Option<String> {
    let (kind, table) = match error.kind() {
        ErrorKind::InvalidSubcommand => (ContextKind::InvalidSubcommand, &COMMANDS[..]),
        ErrorKind::UnknownArgument => (ContextKind::InvalidArg, &OPTIONS[..]),
        _ => return None,
    };
    let Some(ContextValue::String(name)) = error.get(kind) else { return None };
    if name.ends_with(".csv") && error.kind() == ErrorKind::UnknownArgument {
        let usage = error.get(ContextKind::Usage).map(ToString::to_string).unwrap_or_default();
        let instead = match usage.contains("diagnose") {
            true => {
                "put recordings that belong together into a folder with a dataset.toml, and give the folder"
            }
            false => "name the calibration with --calibration cal.json",
        };
        return Some(format!(
            "{name}: only one file can be named here, and this is the second; {instead}"
        ));
    }
    let name = name.split(['=', ' ']).next()?;
    let (_, instead) = table.iter().find(|(old, _)| *old == name)?;
    Some(format!("{name}: {instead}"))
}

#[cfg(test)]
mod tests {
    use super::{COMMANDS, OPTIONS, instead, with_todays_names};
    use crate::command;

    #[test]
    fn what_is_gone_is_not_there_and_says_what_to_write() {
        let now = command();
        let names: Vec<&str> = now.get_subcommands().map(clap::Command::get_name).collect();
        for (name, text) in COMMANDS {
            assert!(!names.contains(&name), "{name}");
            let error = command().try_get_matches_from(["stretch", name]).unwrap_err();
            assert_eq!(instead(&error), Some(format!("{name}: {text}")));
        }
        for (name, text) in OPTIONS {
            let asked = ["stretch", "evaluate", name, "1"];
            let error = command().try_get_matches_from(asked).unwrap_err();
            assert_eq!(instead(&error), Some(format!("{name}: {text}")));
        }
        let asked = ["stretch", "apply", "--calibration", "a.json", "b.csv", "c.csv"];
        let error = command().try_get_matches_from(asked).unwrap_err();
        assert!(instead(&error).is_some_and(|text| text.contains("--calibration")), "{error}");
        let asked = ["stretch", "diagnose", "a.csv", "b.csv"];
        let error = command().try_get_matches_from(asked).unwrap_err();
        assert!(instead(&error).is_some_and(|text| text.contains("dataset.toml")), "{error}");
    }

    #[test]
    fn renamed_options_keep_their_meaning() {
        let new = |line: &str| {
            let words = with_todays_names(line.split(' ').map(Into::into)).into_iter();
            let words: Vec<String> = words.map(|word| word.into_string().unwrap()).collect();
            words.join(" ")
        };
        assert_eq!(new("stretch apply --sample-rate=50 a.csv"), "stretch apply --time=50hz a.csv");
        assert_eq!(new("stretch apply --sample-rate 5 a"), "stretch apply --time=5hz a");
        let several = "stretch calibrate --signals s1,s2 a.csv";
        assert_eq!(new(several), "stretch calibrate --signal=s1,s2 a.csv");
        let asked = "stretch diagnose rig --json-out d.json --quiet";
        assert_eq!(new(asked), "stretch diagnose rig --json=d.json --quiet");
        assert_eq!(new("stretch simulate --preset paper"), "stretch simulate --rig=paper");
        assert_eq!(new("stretch apply -- --sample-rate 5"), "stretch apply -- --sample-rate 5");
    }
}
