//! The programs `stretch-fleet`, for lakes of trials (folders of Parquet files, one per trial), and `stretch-scheduler` and
//! `stretch-executor`, which run its queries on many machines.

mod answers;
mod calibrate;
mod candidates;
pub mod cluster;
mod data_sets;
mod diagnose;
mod drift;
mod ingest;
mod lake;
mod lock;
mod make;
mod month_test;
mod prior;
mod show;
mod sources;
mod sql;
mod states;

use std::{
    any::Any,
    ffi::OsString,
    panic::{AssertUnwindSafe, catch_unwind},
    process::ExitCode,
};

use clap::{Parser, Subcommand};

use show::{message, tell_in_a_line, warn};

/// Collect the trials of many sensors in a lake, and calibrate, query and diagnose them.
#[derive(Debug, Parser)]
#[command(name = "stretch-fleet", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Ingest(ingest::Args),
    Make(make::Args),
    Sql(sql::Args),
    Calibrate(calibrate::Args),
    Drift(drift::Args),
    Prior(prior::Args),
    Diagnose(diagnose::Args),
}

/// Exit status if Ctrl-C ended the program.
const INTERRUPTED: u8 = 130;

/// Runs the program with its name and arguments.
pub fn run(words: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = Cli::parse_from(words);
    tell_in_a_line();
    stretch_gap::cap_threads();
    let runtime = match tokio::runtime::Builder::new_multi_thread().enable_all().build() {
        Ok(runtime) => runtime,
        Err(e) => {
            warn(format!("stretch-fleet: the threads cannot be started: {e}"));
            return ExitCode::FAILURE;
        }
    };
    runtime.spawn(async {
        if tokio::signal::ctrl_c().await.is_ok() {
            stretch_data::files::clean_up_and_exit(INTERRUPTED);
        }
    });
    let work = async {
        match cli.command {
            Command::Ingest(args) => tokio::task::block_in_place(|| ingest::run(args)),
            Command::Make(args) => tokio::task::block_in_place(|| make::run(args)),
            Command::Sql(args) => sql::run(args).await,
            Command::Calibrate(args) => calibrate::run(args).await,
            Command::Drift(args) => drift::run(args).await,
            Command::Prior(args) => tokio::task::block_in_place(|| prior::run(args)),
            Command::Diagnose(args) => tokio::task::block_in_place(|| diagnose::run(args)),
        }
    };
    // A panic in a query, for example on damaged rows, ends the command like any other error.
    let result = catch_unwind(AssertUnwindSafe(|| runtime.block_on(work)));
    match result.unwrap_or_else(|panic| Err(gave_up(panic.as_ref()))) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            warn(format!("stretch-fleet: {}", stretch_data::error_sentence(error.as_ref())));
            ExitCode::FAILURE
        }
    }
}

fn gave_up(panic: &(dyn Any + Send)) -> anyhow::Error {
    anyhow::anyhow!(
        "a reader failed: {}. Damaged rows of a file can cause this: ingest its trial again, or report an error of this program",
        message(panic)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The commands on the documentation pages are valid.
    #[test]
    fn every_command_of_the_pages_is_one() {
        let pages = [
            include_str!("../../README.md"),
            include_str!("../../../book/src/tutorials/fleet.md"),
            include_str!("../../../book/src/tutorials/sleeve.md"),
            include_str!("prior.rs"),
            include_str!("diagnose.rs"),
            include_str!("calibrate.rs"),
            include_str!("drift.rs"),
            include_str!("make.rs"),
        ];
        let lines = pages.iter().flat_map(|page| page.lines());
        let lines = lines.map(|line| line.trim_start_matches("///").trim());
        let mut count = 0;
        for line in lines.filter(|line| line.starts_with("stretch-fleet ") && !line.contains("..."))
        {
            let words = shlex::split(line).expect(line);
            let asked = Cli::try_parse_from(&words);
            assert!(
                asked.is_ok(),
                "{line}: {}",
                asked.err().map(|e| e.to_string()).unwrap_or_default()
            );
            count += 1;
        }
        assert!(count >= 15, "{count} commands were found");
    }
}
