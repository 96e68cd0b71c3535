//! Imports between files go one way.

mod api;
mod dependencies;
mod imports;
mod packages;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use imports::{Imports, Module, circles, imports, module};

/// The text of every file below a folder.
fn sources(folder: &Path) -> BTreeMap<Module, String> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap_or_else(|e| panic!("{}: {e}", next.display())) {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                let below = path.strip_prefix(folder).unwrap().to_str().unwrap();
                found.insert(module(below), fs::read_to_string(&path).unwrap());
            }
        }
    }
    found
}

fn root() -> PathBuf {
    env!("CARGO_MANIFEST_DIR").into()
}

#[test]
fn files_of_a_crate_import_in_no_circle() {
    let crates = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let mut wrong = Vec::new();
    for folder in crates
        .chain(["", "testkit", "challenge", "challenge/blind"].map(|folder| root().join(folder)))
    {
        let found = imports(&sources(&folder.join("src")));
        assert!(!found.is_empty(), "{}: no file", folder.display());
        wrong.extend(circles(&found).iter().map(|line| format!("{}: {line}", folder.display())));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The folders of the engine in the order of its flow: a file imports from its own folder and from those before it.
const ENGINE: [&str; 9] = [
    "numerics", "problem", "fit", "search", "missing", "evidence", "record", "verdict", "diagnose",
];

#[test]
fn folders_of_the_engine_import_in_the_order_of_the_flow() {
    let found = imports(&sources(&root().join("crates/stretch-gap/src")));
    let place = |module: &Module| module.first().and_then(|f| ENGINE.iter().position(|e| e == f));
    for folder in ENGINE {
        assert!(found.keys().any(|m| m.first().is_some_and(|f| f == folder)), "no {folder}");
    }
    let against = found.iter().flat_map(|(from, all)| all.iter().map(move |to| (from, to)));
    let against: Vec<_> =
        against.filter(|(from, to)| place(from).is_some() && place(to) > place(from)).collect();
    assert!(against.is_empty(), "{against:?}");
}

#[test]
fn every_file_of_tests_is_compiled() {
    let crates = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let mut forgotten = Vec::new();
    for folder in crates.chain([root()]) {
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        if !manifest.contains("autotests = false") {
            continue;
        }
        let main = fs::read_to_string(folder.join("tests/main.rs")).unwrap();
        for entry in fs::read_dir(folder.join("tests")).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_stem().unwrap().to_str().unwrap();
            let is_source = path.extension().is_some_and(|end| end == "rs") && name != "main";
            let is_named = main.contains(&format!("mod {name};"))
                || manifest.contains(&format!("[[test]]\nname = \"{name}\"\n"));
            if (is_source || path.join("mod.rs").exists()) && !is_named {
                forgotten.push(path);
            }
        }
    }
    assert!(forgotten.is_empty(), "no test program has {forgotten:?}");
}

/// Imports of a made-up crate, by path below `src`.
fn made_up(files: &[(&str, &str)]) -> Imports {
    imports(&files.iter().map(|(path, text)| (module(path), (*text).to_owned())).collect())
}

#[test]
fn a_planted_circle_is_found_however_it_is_written() {
    let root = ("lib.rs", "mod a; mod b; pub use a::A; pub use b::{B, b};");
    let a = ("a.rs", "use crate::b::B; pub struct A(B);");
    for b in [
        "use crate::a::A; pub struct B(A);",
        "use super::a; pub struct B(a::A);",
        "use crate::{A}; pub struct B(A);",
        "pub struct B; fn b(x: crate::a::A) {}",
        "pub struct B; fn b() { println!(\"{}\", crate::a::A::new()) }",
    ] {
        let found = circles(&made_up(&[root, a, ("b.rs", b)]));
        assert_eq!(found, ["a imports from b", "b imports from a"], "{b}");
    }
    let parent = ("p.rs", "mod c; use c::C; pub const ONE: C = C(1);");
    let child = ("p/c.rs", "use super::ONE; pub struct C(i8);");
    let main = ("main.rs", "mod p; fn main() { p::run() }");
    let found = circles(&made_up(&[main, parent, child]));
    assert_eq!(found, ["p imports from p::c", "p::c imports from p"]);
}

#[test]
fn handing_on_and_testing_make_no_circle() {
    let found = made_up(&[
        ("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"),
        ("a/mod.rs", "mod c; pub use c::C; pub struct A(crate::B);"),
        ("a/c.rs", "pub struct C; #[cfg(test)] mod tests { use super::*; use crate::A; }"),
        ("b.rs", "use crate::a::C; pub struct B(C);"),
    ]);
    assert_eq!(circles(&found), [""; 0]);
    assert_eq!(found[&module("b.rs")], [module("a/c.rs")].into());
}

/// Crates that firmware is built on: what they show is kept in `docs/api`, so that a release cannot take it away unseen.
const SHOWN: [&str; 7] = [
    "stretch-core",
    "stretch-filter",
    "stretch-fit",
    "stretch-metrics",
    "stretch-effects",
    "stretch-receptor",
    "stretch-link",
];

/// `STRETCH_API=write cargo test --test it public` writes the listings anew: then look at what git says has changed.
#[test]
fn public_items_are_those_that_are_listed() {
    let is_writing = std::env::var("STRETCH_API").is_ok_and(|what| what == "write");
    let mut changed = Vec::new();
    for name in SHOWN {
        let source = root().join("crates").join(name).join("src");
        let lines = api::listing(&texts(&source));
        assert!(lines.len() > 5, "{name}: {lines:?}");
        let path = root().join("docs/api").join(format!("{name}.txt"));
        if is_writing {
            fs::create_dir_all(root().join("docs/api")).unwrap();
            fs::write(&path, lines.join("\n") + "\n").unwrap();
            continue;
        }
        let listed = fs::read_to_string(&path).unwrap_or_default();
        let listed: Vec<&str> = listed.lines().collect();
        let gone = listed.iter().filter(|old| !lines.iter().any(|new| new == *old));
        changed.extend(gone.map(|line| format!("{name} - {line}")));
        let came = lines.iter().filter(|new| !listed.contains(&new.as_str()));
        changed.extend(came.map(|line| format!("{name} + {line}")));
    }
    assert!(
        changed.is_empty(),
        "public items are others than docs/api says. Where that is meant, say it in the crate's CHANGELOG.md and run\n    \
         STRETCH_API=write cargo test --test it public\n{}",
        changed.join("\n")
    );
}

/// The text of every file below a folder, by its path there.
fn texts(folder: &Path) -> BTreeMap<String, String> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                let below = path.strip_prefix(folder).unwrap().to_str().unwrap().replace('\\', "/");
                found.insert(below, fs::read_to_string(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_public_item_that_goes_or_changes_is_seen() {
    let list = |text: &str| api::listing(&BTreeMap::from([("a.rs".to_owned(), text.to_owned())]));
    let before = "#[derive(Clone)] pub struct A { pub x: f64, y: u8 }\nimpl A { pub fn x(&self) -> f64 { self.x } }";
    let lines = list(before);
    assert_eq!(lines.len(), 2, "{lines:?}");
    // bodies, private fields' types and comments are nobody's business
    let same = before.replace("y: u8", "y: u16").replace("{ self.x }", "{ 1.0 }");
    assert_eq!(list(&same), lines);
    for other in [
        before.replace("pub x: f64", "x: f64"),
        before.replace("-> f64", "-> f32"),
        before.replace("#[derive(Clone)] ", ""),
        before.replace("pub fn", "pub(crate) fn"),
    ] {
        assert_ne!(list(&other), lines, "{other}");
    }
}

#[test]
fn no_program_knows_the_folder_that_it_was_built_in() {
    let crates = fs::read_dir(root().join("crates")).unwrap().map(|entry| entry.unwrap().path());
    let mut knows = Vec::new();
    for folder in crates.chain([root()]) {
        for (path, text) in texts(&folder.join("src")) {
            // tests come last in a file, and stay where they are built
            let shipped = text.split("#[cfg(test)]").next().unwrap_or_default();
            if shipped.contains("env!(\"CARGO_MANIFEST_DIR\")") {
                knows.push(folder.join("src").join(path));
            }
        }
    }
    assert!(knows.is_empty(), "{knows:?}");
}
