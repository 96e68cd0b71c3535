//! `stretch page`: writes the browser version of stretch, which needs no installation.

use std::{
    borrow::Cow,
    env,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, bail, ensure};
use stretch_data::files::{read_whole, write_whole};

use super::shared::say;
use crate::display::warn;

/// File name of the page in the build folder.
const FILE: &str = "index.html";

/// The page that was built before this program (see `build.rs`).
#[cfg(has_page)]
const CARRIED: Option<&[u8]> = Some(include_bytes!(env!("STRETCH_PAGE_FILE")));
#[cfg(not(has_page))]
const CARRIED: Option<&[u8]> = None;

/// Write the page that needs no installation: calibrate, diagnose and listen in a browser
///
/// One HTML file with the same crates in it, compiled to WASM. It opens from a disk, works offline,
/// and sends nothing anywhere: give it to anyone who has recordings and a browser.
///
///   stretch page --out stretch.html
///
/// The program of a release contains the page. A program that was built without the feature page
/// reads it from the path in STRETCH_PAGE, or builds it if the program is in its source tree (first
/// run rustup target add wasm32-unknown-unknown).
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Page to write; an existing file is replaced
    #[arg(long, default_value = "stretch.html", value_name = "page.html")]
    out: PathBuf,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let page = page()?;
    write_whole(&args.out, |out| out.write_all(&page))?;
    say(format!(
        "wrote {}: open it in a browser; {:.1} MB, and nothing else is needed",
        args.out.display(),
        page.len() as f64 / 1e6
    ))
}

/// Returns the page named by `STRETCH_PAGE`, otherwise the embedded one, otherwise builds it.
fn page() -> anyhow::Result<Cow<'static, [u8]>> {
    let from = match (env::var_os("STRETCH_PAGE"), CARRIED) {
        (Some(asked), _) => {
            let asked = PathBuf::from(asked);
            let file = if asked.is_dir() { asked.join(FILE) } else { asked };
            ensure!(file.is_file(), "STRETCH_PAGE: {}: there is no such file", file.display());
            file
        }
        (None, Some(page)) => return Ok(page.into()),
        (None, None) => build()?,
    };
    let page = read_whole(&from).with_context(|| from.display().to_string())?;
    let is_page = page.starts_with(b"<!DOCTYPE html>") && page.ends_with(b"</html>\n");
    ensure!(
        is_page,
        "{}: this is not a page of stretch; build it with web/build.sh",
        from.display()
    );
    Ok(page.into())
}

/// Builds the page in the source tree that contains this program.
fn build() -> anyhow::Result<PathBuf> {
    let program = env::current_exe().ok();
    let Some((target, script)) = program.as_deref().and_then(sources) else {
        bail!(
            "this program does not contain the page, and it is not in its source tree: use the program of a release, \
             or set STRETCH_PAGE to the folder that web/build.sh made (target/page)"
        );
    };
    warn("stretch: building the page; this takes some minutes the first time");
    let built = Command::new(&script).env("CARGO_TARGET_DIR", &target).status();
    let built = built.with_context(|| format!("{}: it could not be run", script.display()))?;
    ensure!(built.success(), "{}: it did not build the page", script.display());
    Ok(target.join("page").join(FILE))
}

/// Returns Cargo's target folder and the script that builds the page, if the program is located in
/// the target folder of the source tree.
fn sources(program: &Path) -> Option<(PathBuf, PathBuf)> {
    let target = program.ancestors().find(|folder| folder.ends_with("target"))?;
    let script = target.parent()?.join("web/build.sh");
    let is_built_here = target.join("CACHEDIR.TAG").is_file() && script.is_file();
    is_built_here.then(|| (target.to_owned(), script))
}
