//! With the feature `page`, finds the page that was built beforehand and embeds it in the program.
//! `STRETCH_PAGE` names the page; the default is the output of web/build.sh. A named page that is
//! missing is an error, because a release would lack it. Without a named page, a missing page is
//! not embedded.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

const ASKED: &str = "STRETCH_PAGE";

fn main() {
    println!("cargo::rustc-check-cfg=cfg(has_page)");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var_os("CARGO_FEATURE_PAGE").is_none() {
        return;
    }
    println!("cargo::rerun-if-env-changed={ASKED}");
    println!("cargo::rerun-if-env-changed=CARGO_TARGET_DIR");
    let asked = env::var_os(ASKED).map(PathBuf::from);
    let built = || {
        let root = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default();
        let target = env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
        Path::new(&root).join(target).join("page")
    };
    let at = asked.clone().unwrap_or_else(built);
    let file =
        if at.extension().is_some_and(|end| end == "html") { at } else { at.join("index.html") };
    println!("cargo::rerun-if-changed={}", file.display());
    let is_page = fs::read(&file).is_ok_and(|page| page.starts_with(b"<!DOCTYPE html>"));
    if is_page {
        println!("cargo::rustc-env=STRETCH_PAGE_FILE={}", file.display());
        println!("cargo::rustc-cfg=has_page");
    } else if asked.is_some() {
        println!(
            "cargo::error={ASKED}: {}: there is no page; web/build.sh makes one",
            file.display()
        );
    } else {
        println!(
            "cargo::warning=the program will carry no page: there is no {}; web/build.sh makes one",
            file.display()
        );
    }
}
