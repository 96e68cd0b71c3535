//! What the registry and its pages of documentation say of each crate.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The folders of the packages that can be published: the crates, and the program.
fn crates() -> Vec<PathBuf> {
    let entries = fs::read_dir(super::root().join("crates")).expect("the crates");
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    folders.sort();
    folders.push(super::root());
    folders
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The package table of a manifest, as it stands when the workspace's entries are filled in.
fn package(manifest: &Path) -> toml::Table {
    let mut manifest: toml::Table = read(manifest).parse().expect("a manifest");
    let own = manifest.remove("package").and_then(|p| p.as_table().cloned()).expect("a package");
    let workspace: toml::Table =
        read(&super::root().join("Cargo.toml")).parse().expect("a manifest");
    let shared = &workspace["workspace"]["package"];
    let fill = |(key, value): (String, toml::Value)| match value.get("workspace") {
        Some(_) => (key.clone(), shared[&key].clone()),
        None => (key, value),
    };
    own.into_iter().map(fill).collect()
}

#[test]
fn every_crate_says_truly_what_it_is() {
    for folder in crates() {
        let package = package(&folder.join("Cargo.toml"));
        let name = package["name"].as_str().expect("a name").to_owned();
        let list = |key: &str| -> Vec<String> {
            let entries = package.get(key).and_then(toml::Value::as_array);
            let entries = entries.unwrap_or_else(|| panic!("{name}: no {key}"));
            entries.iter().filter_map(toml::Value::as_str).map(str::to_owned).collect()
        };
        let categories = list("categories");
        // a program is for no board
        let is_for_boards = fs::read_to_string(folder.join("src/lib.rs"))
            .is_ok_and(|text| text.contains("#![no_std]"));
        let says_so = categories.iter().any(|category| category == "no-std");
        assert_eq!(says_so, is_for_boards, "{name}: {categories:?}");
        // what the registry accepts
        let keywords = list("keywords");
        assert!((1..=5).contains(&keywords.len()), "{name}: {keywords:?}");
        assert!(keywords.iter().all(|word| word.len() <= 20 && !word.contains(' ')), "{name}");
        assert!(package["description"].as_str().is_some_and(|text| text.len() > 20), "{name}");
        assert!(package["metadata"].get("docs").is_some(), "{name}: no package.metadata.docs.rs");
    }
}

#[test]
fn every_package_carries_both_licences() {
    for folder in crates().into_iter().chain([super::root().join("python")]) {
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert_eq!(
                read(&folder.join(licence)),
                read(&super::root().join(licence)),
                "{}: {licence}",
                folder.display()
            );
        }
    }
}

#[test]
fn pages_of_crates_link_to_nothing_that_is_not_packaged() {
    for folder in crates() {
        let package = package(&folder.join("Cargo.toml"));
        let page = read(&folder.join(package["readme"].as_str().expect("a page")));
        let targets = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for target in targets.filter(|target| target.contains('/') || target.ends_with(".md")) {
            assert!(target.starts_with("https://"), "{}: {target}", folder.display());
        }
    }
}
