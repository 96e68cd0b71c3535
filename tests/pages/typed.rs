//! Runs every shell command in the README and the book, in order, in an empty folder for each page.

use std::{
    fmt::Write,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use super::markdown::{blocks, pages, read, root};
use crate::support::{Scratch, program};

/// Beginnings of commands that are not run, and the reasons.
const NOT_TYPED: [(&str, &str); 11] = [
    ("cargo test", "these are its tests"),
    ("cargo install", "it installs a program"),
    ("cargo build", "it builds the program anew"),
    ("cargo add", "it needs a project of the reader's"),
    ("pip install", "the Python package has a gate of its own"),
    ("python -m stretch_gap", "the Python package has a gate of its own"),
    ("stretch listen", "it needs a board"),
    ("stretch page", "it needs the page that the program of a release carries"),
    ("stretch-fleet", "the fleet has a gate of its own"),
    ("python examples/machines/", "it needs recordings of others"),
    ("cargo run --release -p stretch-challenge", "the challenge has a gate of its own"),
];

/// Returns the shell commands of a page as one script. Files are written where the page asks the
/// reader to save them.
fn script(page: &str) -> String {
    let mut script = String::new();
    for block in blocks(page) {
        match (block.language, block.file) {
            (_, Some(file)) => {
                write!(script, "cat > '{file}' <<'END OF FILE'\n{}END OF FILE\n", block.text)
            }
            ("sh", None) => {
                let typed =
                    |line: &&str| !NOT_TYPED.iter().any(|(start, _)| line.starts_with(start));
                let lines: Vec<&str> = block.text.lines().filter(typed).collect();
                writeln!(script, "{}", lines.join("\n"))
            }
            _ => Ok(()),
        }
        .expect("a text");
    }
    script.replace("cargo run --release -- ", "stretch ")
}

/// Runs the commands of a page in an empty folder. Only the program itself is on the path.
fn type_page(name: &str) {
    let scratch = Scratch::new();
    for folder in ["bin", "here"] {
        fs::create_dir(scratch.path(folder)).expect("a folder");
    }
    let program = program().canonicalize().expect("the program");
    #[cfg(unix)]
    std::os::unix::fs::symlink(program, scratch.path("bin/stretch")).expect("a link");
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = [scratch.path("bin")].into_iter().chain(std::env::split_paths(&path));
    let output = Command::new("sh")
        .args(["-exc", &script(&read(Path::new(name)))])
        .current_dir(scratch.path("here"))
        .env("PATH", std::env::join_paths(folders).expect("a path"))
        .env_remove("STRETCH_DATA")
        .output()
        .expect("a shell");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{name}: {error}{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn every_page_with_shell_is_typed_by_a_test() {
    let tests = fs::read_to_string(root().join("tests/pages/typed.rs")).expect("this file");
    let has_shell = |page: &PathBuf| script(&read(page)).contains("stretch ");
    for page in pages().iter().filter(|page| has_shell(page)) {
        let call = format!("type_page(\"{}\")", page.to_str().expect("a name"));
        assert!(tests.contains(&call), "no test types {}", page.display());
    }
}

#[test]
fn what_is_not_typed_stands_on_a_page() {
    let all: String = pages().iter().map(|page| read(page)).collect();
    for (start, why) in NOT_TYPED {
        assert!(all.lines().any(|line| line.starts_with(start)), "no page has {start} ({why})");
    }
}

#[test]
fn a_page_becomes_a_script() {
    let page = "Save it as `a.csv`:\n```text\n1\n```\n```sh\ncargo run --release -- demo\ncargo test\nls\n```\n";
    assert_eq!(script(page), "cat > 'a.csv' <<'END OF FILE'\n1\nEND OF FILE\nstretch demo\nls\n");
}

#[test]
#[ignore = "the demo and two diagnoses, a minute; ./ci.sh runs it"]
fn the_readme_is_typed_from_top_to_bottom() {
    type_page("README.md");
}

#[test]
#[ignore = "the demo and a diagnosis; ./ci.sh runs it"]
fn the_page_in_an_archive_is_typed() {
    type_page("release/README.md");
}

#[test]
#[ignore = "calibrations and a diagnosis; ./ci.sh runs it"]
fn the_tutorial_of_the_laboratory_is_typed() {
    type_page("book/src/tutorials/lab.md");
}

#[test]
fn the_tutorial_of_a_load_cell_is_typed() {
    type_page("book/src/tutorials/load_cell.md");
}

#[test]
#[ignore = "simulations and calibrations; ./ci.sh runs it"]
fn the_tutorial_of_sensors_that_are_put_on_again_is_typed() {
    type_page("book/src/tutorials/sleeve.md");
}

#[test]
#[ignore = "calibrations; ./ci.sh runs it"]
fn the_tutorial_of_firmware_is_typed() {
    type_page("book/src/tutorials/firmware.md");
}

#[test]
#[ignore = "needs python3; ./ci.sh runs it"]
fn with_python_the_tutorial_of_a_worker_is_typed() {
    type_page("book/src/tutorials/worker.md");
}

#[test]
#[ignore = "diagnoses; ./ci.sh runs it"]
fn pages_of_how_to_do_something_are_typed() {
    type_page("book/src/how-to/verdicts.md");
    type_page("book/src/how-to/fix.md");
    type_page("book/src/how-to/ci.md");
    type_page("book/src/how-to/recordings.md");
    type_page("book/src/how-to/compare.md");
}

#[test]
#[ignore = "needs python3 with NumPy; ./ci.sh runs it"]
fn with_numpy_the_page_of_plans_is_typed() {
    type_page("book/src/how-to/plan.md");
}

#[test]
#[ignore = "a diagnosis; ./ci.sh runs it"]
fn the_page_of_the_json_is_typed() {
    type_page("book/src/reference/diagnosis.md");
}
