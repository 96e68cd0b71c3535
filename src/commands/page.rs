//! `stretch page`: the page that needs no installation.

use std::{
    borrow::Cow,
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, bail, ensure};
use stretch_files::{write_folder, write_whole};

use super::shared::{or_force, recover, say};
use crate::display::warn;

/// The page's one file.
const FILE: &str = "index.html";

/// The page that was built before this program (`build.rs`).
#[cfg(has_page)]
const CARRIED: Option<&[u8]> = Some(include_bytes!(env!("STRETCH_PAGE_FILE")));
#[cfg(not(has_page))]
const CARRIED: Option<&[u8]> = None;

/// Write the page that needs no installation: calibrate, diagnose and listen in a browser
///
/// One HTML file with the same crates in it, compiled to WASM. It opens from a disk, works offline,
/// and sends nothing anywhere: give it to whoever has recordings and a browser.
///
///   stretch page --out page
///
/// A program of a release carries the page. One that was built without the feature page takes it
/// from where STRETCH_PAGE says, or builds it in the source tree that it stands in (rustup target
/// add wasm32-unknown-unknown).
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder for index.html
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace a page that exists; files of your own in its folder are kept
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    recover(&args.out)?;
    let page = page()?;
    write_folder(&args.out, args.force, |folder| {
        Ok(write_whole(folder.join(FILE), |out| out.write_all(&page))?)
    })
    .map_err(or_force)?;
    say(format!(
        "wrote {}: open it in a browser; {:.1} MB, and nothing else is needed",
        args.out.join(FILE).display(),
        page.len() as f64 / 1e6
    ))
}

/// The page: the one that is asked for, the one that this program carries, or one that is built.
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
    let page = fs::read(&from).with_context(|| from.display().to_string())?;
    let is_page = page.starts_with(b"<!DOCTYPE html>") && page.ends_with(b"</html>\n");
    ensure!(is_page, "{}: this is no page of stretch; build it with web/build.sh", from.display());
    Ok(page.into())
}

/// Builds the page in the source tree that this program stands in.
fn build() -> anyhow::Result<PathBuf> {
    let program = env::current_exe().ok();
    let Some(web) = program.as_deref().and_then(sources) else {
        bail!(
            "this program carries no page, and it does not stand in its source tree: take the program of a release, \
             or set STRETCH_PAGE to the folder that web/build.sh made (web/target/page)"
        );
    };
    let script = web.join("build.sh");
    warn("stretch: building the page, some minutes the first time");
    let built = Command::new(&script).status();
    let built = built.with_context(|| format!("{}: it could not be run", script.display()))?;
    ensure!(built.success(), "{}: it did not build the page", script.display());
    Ok(web.join("target/page").join(FILE))
}

/// The folder of the page's sources, where a program stands in the folder target of its source tree, as cargo builds it.
fn sources(program: &Path) -> Option<PathBuf> {
    let target = program.ancestors().find(|folder| folder.ends_with("target"))?;
    let web = target.parent()?.join("web");
    (target.join("CACHEDIR.TAG").is_file() && web.join("build.sh").is_file()).then_some(web)
}
