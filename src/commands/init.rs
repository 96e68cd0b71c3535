//! `stretch init`: a first problem from a folder of recordings.

use std::path::PathBuf;

use anyhow::ensure;
use stretch_problem::first_problem;

use super::shared::{tell, write_text};

/// Write a first problem.toml from the recordings in a folder
///
///   stretch init bench
///   stretch diagnose bench/problem.toml
///
/// It holds the columns with units and ranges, rates, the trials with a proposed split, and says in
/// comments what was guessed: what drives the simulator, and what is held against it.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Folder of recordings
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Replace a problem.toml that is there
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let path = args.folder.join("problem.toml");
    ensure!(
        args.force || !path.exists(),
        "{}: it is there already; --force replaces it",
        path.display()
    );
    write_text(&path, &first_problem(&args.folder)?)?;
    tell(format!(
        "wrote {}: read its comments, write the simulator, then stretch diagnose it",
        path.display()
    ))
}
