//! Pages of the reference that the program writes: its command line and its catalogue of effects.
//!
//! `STRETCH_PAGES=write cargo test --test it pages` writes them anew.

use std::fs;

use super::markdown::root;
use crate::support::{prints, stretch};

/// What the program prints, as a block.
fn block(arguments: &[&str]) -> String {
    let mut program = stretch();
    // as wide as where there is no terminal
    program.args(arguments).env_remove("COLUMNS");
    let text = prints(&mut program);
    let lines: Vec<&str> = text.trim_end().lines().map(str::trim_end).collect();
    format!("```text\n{}\n```\n", lines.join("\n"))
}

/// Names of the commands, as the help lists them; `fleet` is a separate program with its own help.
fn commands() -> Vec<String> {
    let help = prints(stretch().arg("--help"));
    let (_, list) = help.split_once("\nCommands:\n").expect("a list of commands");
    let names = list.lines().take_while(|line| !line.is_empty()).filter_map(|line| {
        // a separate line has two blanks in front, the rest of a long one more
        let name = line.strip_prefix("  ")?.split(' ').next()?;
        (!["", "help", "fleet"].contains(&name)).then(|| name.to_owned())
    });
    names.collect()
}

pub(super) fn is_written_by_the_program(page: &str, text: &str) {
    let path = root().join("book/src/reference").join(page);
    if std::env::var("STRETCH_PAGES").is_ok_and(|what| what == "write") {
        fs::write(path, text).expect("the page");
    } else {
        let now = fs::read_to_string(path).unwrap_or_default();
        let how = "STRETCH_PAGES=write cargo test --test it pages writes it anew";
        assert!(now == text, "{page} differs from what the program says; {how}");
    }
}

#[test]
fn the_command_line_is_what_the_program_says() {
    let names = commands();
    assert!(names.iter().any(|name| name == "calibrate"), "{names:?}");
    let mut text = "# Command line\n\nThis page is the program's own help.\n\n".to_owned();
    text += &block(&["--help"]);
    for name in &names {
        text += &format!("\n## stretch {name}\n\n{}", block(&[name, "--help"]));
    }
    is_written_by_the_program("command_line.md", &text);
}

#[test]
fn the_effects_are_those_of_the_catalogue() {
    let mut text = "# Effects\n\nThis page is what `stretch effects` and `stretch effects kinds` print: name, meaning in words, equation,\n\
                    and the range of each parameter. A *form* is a detail of the shape that is fitted around its usual value, which\n\
                    stands in brackets, and does not count as a parameter.\n\n## In the rig, stage by stage\n\n"
        .to_owned();
    text += &block(&["effects"]);
    text += "\n## Around any simulator\n\n";
    text += &block(&["effects", "kinds"]);
    is_written_by_the_program("effects.md", &text);
}

#[test]
fn the_keys_of_problems_and_diagnoses_are_those_of_the_crates() {
    let mut text = "# problem.toml\n\nAll keys of a problem file. `problem.schema.json` next to this page describes the same keys for editors.\n\
                    [The worker protocol](worker.md) describes the requests to a worker and its answers.\n\n"
        .to_owned();
    text += &stretch_problem::problem_reference();
    is_written_by_the_program("problem.md", &text);
    let schema = serde_json::to_string_pretty(&stretch_problem::problem_schema()).expect("JSON");
    is_written_by_the_program("problem.schema.json", &(schema + "\n"));
    let schema = serde_json::to_string_pretty(&stretch_problem::diagnosis_schema()).expect("JSON");
    is_written_by_the_program("diagnosis.schema.json", &(schema + "\n"));
}
