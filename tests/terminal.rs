//! Properties of all commands on a terminal: amount of output, line width, colours, JSON, the path
//! `-`, and exit status.

use std::fs;

use crate::support::{Scratch, calibrate, fails, json_to, one_line, prints, runs, stdout, stretch};
use clap_complete::Shell;
use serde_json::Value;

/// Simulates a rig with hysteresis, which a diagnosis names, and a rig without any effect.
fn benches() -> Scratch {
    let scratch = Scratch::new();
    for (name, effect) in [("bench", Some("gauge_hysteresis:h=0.2,s=0.012")), ("plain", None)] {
        let mut command = stretch();
        command.args(["simulate", "--protocol", "pulses", "--out"]).arg(scratch.path(name));
        effect.into_iter().for_each(|effect| {
            command.args(["--effect", effect]);
        });
        runs(&mut command);
    }
    scratch
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

#[test]
fn verdicts_that_are_named_have_a_status_of_their_own() {
    let scratch = benches();
    let status = |folder: &str, on: &str| {
        let mut command = stretch();
        command.arg("diagnose").arg(scratch.path(folder)).args(["--no-next", "--fail-on", on]);
        let output = command.output().unwrap();
        // The result is printed whatever the exit status.
        assert!(stdout(&output).lines().count() > 5, "{folder} {on}");
        output.status.code()
    };
    for (folder, on, code) in [
        ("bench", "effect", 3),
        ("bench", "record,gap", 3),
        ("bench", "any", 3),
        ("bench", "unknown,record,faint,parameters", 0),
        ("plain", "effect,unknown,record,gap", 0),
    ] {
        assert_eq!(status(folder, on), Some(code), "{folder} --fail-on {on}");
    }
    let mut unknown = stretch();
    unknown.args(["diagnose", "bench", "--fail-on", "sorrow"]);
    assert_eq!(unknown.output().unwrap().status.code(), Some(2));
    let told = runs(stretch().arg("--help"));
    for status in ["0    done", "1    not done", "2    the arguments", "3    done", "130  ended"] {
        assert!(told.contains(status), "{status}");
    }
}

#[test]
fn json_is_a_flag_and_a_file_has_an_option() {
    let scratch = benches();
    let bench = scratch.path("bench");
    let mut command = stretch();
    let printed = runs(command.arg("diagnose").arg(&bench).args(["--no-next", "--json"]));
    let file = scratch.path("d.json");
    let mut command = stretch();
    command.arg("diagnose").arg(&bench).arg("--no-next").arg(json_to(&file));
    let text = runs(&mut command);
    let mut by_dash = stretch();
    by_dash.current_dir(scratch.path("")).args("diagnose bench --no-next --json=-".split(' '));
    let dashed = runs(&mut by_dash);
    assert!(text.contains("wrote ") && one_line(&text).contains("The simulator lacks"), "{text}");
    let whole = |text: &str| {
        let mut value = json(text);
        value["runtime_s"] = Value::Null;
        value
    };
    let written = whole(&fs::read_to_string(&file).unwrap());
    assert_eq!(whole(&printed), written);
    assert_eq!(whole(&dashed), written);
    assert_eq!(written["verdict"], "effect");
    // Other commands.
    let trial = scratch.loops("a.csv", 20.0, 1.1);
    let cal = scratch.path("cal.json");
    let told = json(&runs(calibrate(&trial, &cal).arg("--json")));
    assert_eq!(told["model"], "poly13");
    let seen = |mut command: assert_cmd::Command| json(&runs(command.arg("--json")));
    let with = |line: &str| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        command
    };
    assert_eq!(seen(with("evaluate --calibration cal.json a.csv"))["unit"], "mm");
    assert_eq!(seen(with("effects gauge_hysteresis"))[0]["name"], "gauge_hysteresis");
    let file = scratch.path("e.json");
    runs(with("evaluate --calibration cal.json a.csv").arg(json_to(&file)));
    assert_eq!(json(&fs::read_to_string(file).unwrap())["unit"], "mm");
    // An earlier form of the option.
    for (line, says) in [
        ("diagnose bench --json d.json", "write --json=d.json for a file"),
        ("diagnose --json d.json bench", "write --json=d.json for a file"),
        ("diagnose bench --json -", "write --json alone"),
    ] {
        let output = with(line).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        let told = one_line(&String::from_utf8(output.stderr).unwrap());
        assert!(told.contains(says) && told.lines().count() == 1, "{line}: {told}");
    }
    let both = "diagnose bench --no-next --json --report -";
    fails(&mut with(both), &["cannot both go to standard output", "--json="]);
}

#[test]
fn a_dash_is_a_stream_and_never_a_file() {
    let scratch = benches();
    scratch.loops("a.csv", 20.0, 1.1);
    runs(&mut calibrate(&scratch.path("a.csv"), &scratch.path("cal.json")));
    let with = |line: &str| {
        let mut command = stretch();
        command.current_dir(scratch.path("")).args(line.split(' '));
        command
    };
    let before = scratch.names();
    let out = |line: &str| runs(&mut with(line));
    assert!(out("convert a.csv --out -").starts_with("time_s,length_mm,bridge_v\n0,"));
    assert_eq!(json(&out("calibrate a.csv --out -"))["signal"], "bridge_v");
    assert!(out("calibrate a.csv --out x.json --report -").starts_with("<!DOCTYPE html>"));
    fs::remove_file(scratch.path("x.json")).unwrap();
    assert!(out("apply --calibration cal.json a.csv --out -").starts_with("time_s,estimate_mm"));
    assert!(out("diagnose bench --no-next --report -").starts_with("<!DOCTYPE html>"));
    assert!(out("diagnose bench --no-next --fix -").contains("gauge_hysteresis"));
    assert!(out("export --calibration cal.json --c -").contains("stretch_step("));
    let trial = out("simulate --protocol pulses --out -");
    assert!(trial == fs::read_to_string(scratch.path("plain/pulses_1.csv")).unwrap());
    fails(&mut with("simulate --protocol paper --out -"), &["17 trials", "--protocol"]);
    for line in [
        "export --calibration cal.json --c - --arduino",
        "diagnose bench --no-next --snippets -",
        "demo --out -",
    ] {
        fails(&mut with(line), &["name"]);
    }
    assert_eq!(scratch.names(), before, "nothing is called -, and nothing else is left");
}

#[test]
fn quiet_says_results_and_errors_and_verbose_says_how() {
    let scratch = Scratch::new();
    let trial = scratch.loops("a.csv", 20.0, 1.1);
    let said = |flag: Option<&str>| {
        let mut command = calibrate(&trial, &scratch.path("cal.json"));
        let output = command.args(flag).output().unwrap();
        assert!(output.status.success());
        (stdout(&output), String::from_utf8(output.stderr).unwrap())
    };
    let ((usual, aside), (quiet, nothing), (_, verbose)) =
        (said(None), said(Some("--quiet")), said(Some("-v")));
    assert!(usual.contains("\nwrote ") && aside.is_empty(), "{usual}{aside}");
    // The sentence comes first, and at most fifteen lines follow. With -q, only the paths follow.
    let sentence = "On the same recordings as the fit, poly13 is off by";
    assert!(usual.starts_with(sentence) && usual.lines().count() <= 17, "{usual}");
    assert!(one_line(&usual).contains("it needs at least 8 movements"), "{usual}");
    assert!(quiet.starts_with(sentence) && quiet.contains("\nwrote "), "{quiet}");
    assert!(!quiet.contains('|') && !quiet.contains("note:"), "{quiet}");
    let judged = |flags: &[&str]| {
        let mut command = stretch();
        command.args(["evaluate", "--calibration"]).arg(scratch.path("cal.json")).arg(&trial);
        prints(command.args(flags))
    };
    let (usual, quiet, all) = (judged(&[]), judged(&["-q"]), judged(&["-v"]));
    assert!(
        quiet.starts_with("Calibration cal is off by") && quiet.lines().count() <= 2,
        "{quiet}"
    );
    assert!(usual.starts_with(&quiet) && usual.contains("Bias, mm"), "{usual}");
    assert!(all.starts_with(&quiet) && all.contains("paired t test"), "{all}");
    assert!(!usual.contains("paired t test") && usual.lines().count() <= 17, "{usual}");
    let mut many = stretch();
    many.arg("evaluate");
    (0..10).for_each(|_| {
        many.arg("--calibration").arg(scratch.path("cal.json"));
    });
    let many = prints(many.arg(&trial));
    assert!(many.starts_with("Calibration cal, the best of 10, is off by"), "{many}");
    assert!(many.contains("(9 of 11 rows)"), "{many}");
    assert_eq!(nothing, "");
    for part in [" s] read a.csv: 2000 samples", " s] fitted poly13 to length_mm", " s] the end"] {
        assert!(verbose.contains(part), "{part}: {verbose}");
    }
    let mut command = stretch();
    fails(command.args(["-q", "evaluate", "--calibration", "none.json", "a.csv"]), &["none.json"]);
    let both = stretch().args(["-q", "-v", "effects"]).output().unwrap();
    assert_eq!(both.status.code(), Some(2));
}

/// Runs a command with a line width given by `COLUMNS`, and returns its output.
fn at_width(scratch: &Scratch, line: &str, columns: Option<usize>) -> String {
    let mut command = stretch();
    command.current_dir(scratch.path("")).args(line.split(' ')).env_remove("COLUMNS");
    columns.into_iter().for_each(|columns| {
        command.env("COLUMNS", columns.to_string());
    });
    let output = command.output().unwrap();
    stdout(&output) + &String::from_utf8(output.stderr).unwrap()
}

#[test]
#[ignore = "every command in a pseudo-terminal; ./ci.sh runs it"]
fn no_line_is_wider_than_the_terminal_or_a_hundred_columns() {
    let scratch = benches();
    scratch.loops("a.csv", 20.0, 1.1);
    runs(&mut calibrate(&scratch.path("a.csv"), &scratch.path("cal.json")));
    let lines = [
        "calibrate a.csv --model auto --out x.json -v",
        "evaluate --calibration cal.json a.csv",
        "diagnose bench --no-next -v",
        "diagnose plain --no-next",
        "effects",
        "demo --data nowhere --out nothing",
    ];
    let mut helps: Vec<String> = vec!["--help".to_owned()];
    let listed = prints(stretch().arg("help"));
    let commands = listed.lines().skip_while(|line| *line != "Commands:").skip(1);
    let names =
        commands.take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    helps.extend(names.map(|line| format!("{} --help", line.split_whitespace().next().unwrap())));
    assert!(helps.len() > 14, "the program and its commands: {helps:?}");
    for line in lines.iter().copied().chain(helps.iter().map(String::as_str)) {
        let told = at_width(&scratch, line, None);
        let widest = told.lines().map(|line| line.chars().count()).max().unwrap_or(0);
        assert!((20..=100).contains(&widest), "{line}: {widest}:\n{told}");
    }
    for line in &lines[..5] {
        let narrow = at_width(&scratch, line, Some(60));
        for row in narrow.lines().filter(|row| row.chars().count() > 60) {
            assert!(
                !row.trim().contains(' '),
                "{line}: a word that cannot break stands alone: {row}"
            );
        }
        // Narrower output contains the same words.
        let words = |text: &str| -> std::collections::BTreeSet<String> {
            // With -v, lines begin with the elapsed time, which differs between runs.
            let stamp = |line: &str| line.starts_with('[').then(|| line.find(']')).flatten();
            let said = text.lines().map(|line| &line[stamp(line).map_or(0, |end| end + 1)..]);
            let own = said
                .flat_map(str::split_whitespace)
                .filter(|word| word.chars().any(char::is_alphanumeric));
            own.map(str::to_owned).collect()
        };
        let wide = words(&at_width(&scratch, line, Some(100)));
        let lost: Vec<_> = wide.difference(&words(&narrow)).cloned().collect();
        assert!(lost.is_empty(), "{line}: {lost:?}");
    }
}

#[test]
fn colours_follow_the_terminal_and_no_color() {
    let scratch = benches();
    let said = |set: &[(&str, &str)]| {
        let mut command = stretch();
        command.arg("diagnose").arg(scratch.path("plain")).arg("--no-next");
        for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "CI"] {
            command.env_remove(name);
        }
        runs(command.envs(set.iter().copied()))
    };
    assert!(!said(&[]).contains('\u{1b}'), "there is no terminal");
    let coloured = said(&[("CLICOLOR_FORCE", "1")]);
    assert!(coloured.starts_with("\u{1b}[1m") && coloured.contains("\u{1b}[0m"), "{coloured}");
    assert!(!said(&[("NO_COLOR", "1")]).contains('\u{1b}'));
}

/// Counts the options that a command lists in its help, without help, version, and the global
/// options.
fn options(command: &clap::Command) -> usize {
    let is_own = |argument: &&clap::Arg| {
        !argument.is_positional()
            && !argument.is_hide_set()
            && !["help", "version", "quiet", "verbose"].contains(&argument.get_id().as_str())
    };
    let below = command.get_subcommands().filter(|below| below.get_name() != "help");
    command.get_arguments().filter(is_own).count() + below.map(options).sum::<usize>()
}

/// A command's help must be short, and the numbers of commands and options must remain small. The
/// fifteenth command is `compare`, which needs no simulator and no calibration, only two recordings.
/// Its four options have the names and meanings of those of other commands. `plan` and `rehearse` need
/// a simulator and no recordings, so they are no options of `diagnose`. Of their five options, only
/// `--only` is new.
#[test]
fn commands_and_options_are_few_and_a_short_help_fits_a_screen() {
    let program = stretch_cli::command();
    let commands: Vec<_> =
        program.get_subcommands().filter(|command| command.get_name() != "help").collect();
    let counts: Vec<_> = commands.iter().map(|c| (c.get_name(), options(c))).collect();
    let count: usize = counts.iter().map(|(_, count)| count).sum();
    assert!(
        counts.len() <= 17 && count <= 100,
        "{} commands, {count} options: {counts:?}",
        counts.len()
    );
    // A paragraph is one line, which clap breaks at the width of the terminal.
    for text in commands.iter().filter_map(|command| command.get_long_about()) {
        let text = text.to_string();
        let is_prose = |line: &str| !line.is_empty() && !line.starts_with(' ');
        let lines: Vec<&str> = text.lines().collect();
        assert!(!lines.windows(2).any(|w| is_prose(w[0]) && is_prose(w[1])), "{text}");
    }
    let mut lines: Vec<Vec<&str>> = commands.iter().map(|c| vec![c.get_name()]).collect();
    lines.extend([vec!["sleeve", "learn"], vec!["sleeve", "renew"]]);
    for line in lines {
        let help = prints(stretch().args(&line).arg("-h").env_remove("COLUMNS"));
        assert!(help.lines().count() <= 40, "{line:?}: {} lines:\n{help}", help.lines().count());
    }
}

#[test]
fn shells_complete_and_man_has_pages() {
    for (shell, part) in [
        (Shell::Bash, "_stretch()"),
        (Shell::Zsh, "#compdef stretch"),
        (Shell::Fish, "complete -c stretch"),
    ] {
        let mut text = Vec::new();
        clap_complete::generate(shell, &mut stretch_cli::command(), "stretch", &mut text);
        let text = String::from_utf8(text).unwrap();
        assert!(text.contains(part) && text.contains("fail-on"), "{shell}");
        for value in ["observer+rest", "diagnosed", "fixed", "bisquare"] {
            assert!(text.contains(value), "{shell} does not complete {value}");
        }
    }
    let scratch = Scratch::new();
    clap_mangen::generate_to(stretch_cli::command(), scratch.path("")).unwrap();
    let page = |name: &str| fs::read_to_string(scratch.path(name)).unwrap();
    assert!(page("stretch.1").contains("stretch\\-diagnose(1)"));
    assert!(page("stretch-diagnose.1").contains("fail\\-on"));
}
