//! `stretch fleet`: lakes of trials, by a program of its own.

use std::{
    env,
    ffi::OsString,
    path::PathBuf,
    process::{Command, exit},
};

use anyhow::{Context, bail};

/// Years of logs and thousands of sensors: ingest, SQL, calibrations, drift and diagnoses of a lake
///
/// The program stretch-fleet does it, which is built by itself, for it stands on a query engine:
///
///   cargo build --release --manifest-path fleet/Cargo.toml --workspace
#[derive(clap::Args)]
#[command(verbatim_doc_comment, disable_help_flag = true)]
pub(crate) struct Args {
    /// What stretch-fleet is asked; --help says what there is
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "COMMAND")]
    asked: Vec<OsString>,
}

/// Runs `stretch-fleet` and ends as it does.
pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let Some(program) = program() else {
        bail!(
            "there is no stretch-fleet beside stretch or on PATH; build it with: cargo build --release --manifest-path \
             fleet/Cargo.toml --workspace, and put fleet/target/release/stretch-fleet beside stretch"
        );
    };
    let status = Command::new(&program).args(args.asked).status();
    let status = status.with_context(|| program.display().to_string())?;
    exit(status.code().unwrap_or(1))
}

/// Beside this program, or on PATH.
fn program() -> Option<PathBuf> {
    let name = format!("stretch-fleet{}", env::consts::EXE_SUFFIX);
    let own = env::current_exe().ok();
    let beside = own.as_deref().and_then(|own| own.parent()).map(PathBuf::from);
    let path = env::var_os("PATH").unwrap_or_default();
    let folders = beside.into_iter().chain(env::split_paths(&path).collect::<Vec<_>>());
    folders.map(|folder| folder.join(&name)).find(|path| path.is_file())
}
