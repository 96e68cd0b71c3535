//! What the dependencies are for, and under which licences: `docs/dependencies.md` says it of every one.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use serde_json::Value;

/// Licences that ask for nothing but their text; of a choice one is enough.
const FREE: [&str; 12] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "MIT",
    "Unicode-3.0",
    "Unicode-DFS-2016",
    "Unlicense",
    "Zlib",
];

/// Whether a licence lets us: all parts of an `AND`, one of an `OR`.
fn is_free(licence: &str) -> bool {
    let licence = licence.replace('/', " OR ").replace(['(', ')'], "");
    let one = |name: &str| FREE.contains(&name.trim());
    licence.split(" AND ").all(|part| part.split(" OR ").any(one))
}

fn metadata(root: &Path) -> Value {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let arguments = ["metadata", "--format-version", "1", "--locked", "--all-features"];
    let out = Command::new(cargo).current_dir(root).args(arguments).output().expect("cargo runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("JSON")
}

fn list<'a>(value: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> {
    value[key].as_array().into_iter().flatten()
}

#[test]
fn licences_and_sources_are_those_that_were_decided() {
    let metadata = metadata(&super::root());
    let mut wrong = Vec::new();
    for package in list(&metadata, "packages") {
        let text = |key: &str| package[key].as_str().unwrap_or_default();
        let Some(source) = package["source"].as_str() else { continue };
        if !is_free(text("license")) {
            wrong.push(format!("{}: licence {:?}", text("name"), text("license")));
        }
        if !source.starts_with("registry+") {
            wrong.push(format!("{}: comes from {source}", text("name")));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_dependency_has_its_line_and_every_line_its_dependency() {
    let metadata = metadata(&super::root());
    let ours: BTreeSet<&str> =
        list(&metadata, "workspace_members").filter_map(Value::as_str).collect();
    let of_ours = |package: &&Value| package["id"].as_str().is_some_and(|id| ours.contains(id));
    let asked: BTreeSet<String> = list(&metadata, "packages")
        .filter(of_ours)
        .flat_map(|package| list(package, "dependencies"))
        .filter(|dependency| dependency["source"].is_string())
        .filter_map(|dependency| dependency["name"].as_str().map(str::to_owned))
        .collect();
    let page = fs::read_to_string(super::root().join("docs/dependencies.md")).expect("the page");
    let lines = page.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
    let told: BTreeSet<String> = lines.map(|(name, _)| name.to_owned()).collect();
    let missing: Vec<_> = asked.difference(&told).collect();
    let gone: Vec<_> = told.difference(&asked).collect();
    assert!(
        missing.is_empty(),
        "docs/dependencies.md does not say what these are for: {missing:?}"
    );
    assert!(gone.is_empty(), "docs/dependencies.md names what nobody depends on: {gone:?}");
}

#[test]
fn a_licence_is_judged_by_its_parts() {
    for free in ["MIT", "MIT OR LGPL-2.1-or-later", "Apache-2.0/MIT", "(MIT OR X) AND Zlib"] {
        assert!(is_free(free), "{free}");
    }
    for other in ["GPL-3.0", "MIT AND GPL-3.0", "", "MPL-2.0 OR GPL-3.0"] {
        assert!(!is_free(other), "{other}");
    }
}
