//! `stretch man`: the help as man pages.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use clap_mangen::Man;
use stretch_files::{Outputs, is_standard_output};

use super::shared::tell;

/// Write the help as man pages, one a command
///
///   stretch man --out ~/.local/share/man/man1
///   man stretch-diagnose
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder that the pages go to, beside what it holds; it is made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(args: &Args, mut program: clap::Command) -> anyhow::Result<()> {
    let out = &args.out;
    ensure!(!is_standard_output(out), "-: pages are several files; name a folder");
    program.build();
    let mut pages = Vec::new();
    collect(&program, &mut pages)?;
    let made = out.ancestors().take_while(|folder| !folder.exists() && *folder != Path::new(""));
    let made: Vec<&Path> = made.collect();
    fs::create_dir_all(out).with_context(|| format!("{}: cannot make it", out.display()))?;
    let mut outputs = Outputs::default();
    let write = |(name, page): &(String, Vec<u8>)| {
        outputs.file(out.join(format!("{name}.1")), |file| file.write_all(page))
    };
    let written = pages.iter().try_for_each(write).and_then(|()| outputs.keep());
    if written.is_err() {
        // folders that were made for nothing; one that holds something stays
        made.iter().take_while(|folder| fs::remove_dir(folder).is_ok()).count();
    }
    written?;
    tell(format!("wrote {}: {} pages, stretch.1 the first", out.display(), pages.len()))
}

/// The page of a command and of those below it.
fn collect(command: &clap::Command, pages: &mut Vec<(String, Vec<u8>)>) -> anyhow::Result<()> {
    let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page)?;
    pages.push((name, page));
    let mut below = command.get_subcommands().filter(|c| c.get_name() != "help");
    below.try_for_each(|command| collect(command, pages))
}
